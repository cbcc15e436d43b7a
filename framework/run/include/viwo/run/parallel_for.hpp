// Work on many items, several at a time.
#pragma once

#include <cstddef>

#ifdef __SANITIZE_THREAD__
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>

#include <tbb/global_control.h>
#else
#include <tbb/parallel_for.h>
#endif

namespace viwo {

/// Calls work(0) .. work(n - 1), and throws what one of them has thrown.
template <class Work>
void parallel_for(std::size_t n, const Work& work) {
#ifdef __SANITIZE_THREAD__
  // Of how libtbb keeps threads apart the sanitizer sees nothing: all that goes through it would be
  // a race.
  std::atomic<std::size_t> next = 0;
  std::exception_ptr error;
  std::mutex mutex;
  const auto all = [&] {
    for (std::size_t i = next++; i < n; i = next++) {
      try {
        work(i);
      } catch (...) {
        const std::scoped_lock lock(mutex);
        if (!error) error = std::current_exception();
        next = n;
      }
    }
  };
  using Limit = tbb::global_control;
  std::thread other;
  if (Limit::active_value(Limit::max_allowed_parallelism) > 1) other = std::thread(all);
  all();
  if (other.joinable()) other.join();
  if (error) std::rethrow_exception(error);
#else
  tbb::parallel_for(std::size_t{0}, n, work);
#endif
}

}  // namespace viwo
