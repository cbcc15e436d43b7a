// Work on many items by the threads of OpenCV.
#pragma once

#include <cstddef>

#include <opencv2/core/utility.hpp>

#ifdef __SANITIZE_THREAD__
#include <thread>
#endif

namespace viwo::klt {

/// Calls work(0) .. work(n - 1), several at a time, which must not throw.
template <class Work>
void parallel_for(std::size_t n, const Work& work) {
  const cv::Range all(0, static_cast<int>(n));
  const auto part = [&work](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) work(static_cast<std::size_t>(i));
  };
#ifdef __SANITIZE_THREAD__
  // Of how OpenCV keeps its threads apart the sanitizer sees nothing: all would be a race.
  const int middle = cv::getNumThreads() > 1 ? (all.end + 1) / 2 : all.end;
  std::thread other;
  if (middle < all.end) other = std::thread(part, cv::Range(middle, all.end));
  part(cv::Range(0, middle));
  if (other.joinable()) other.join();
#else
  cv::parallel_for_(all, part);
#endif
}

}  // namespace viwo::klt
