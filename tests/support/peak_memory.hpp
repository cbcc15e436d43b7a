// How much memory this process has had at most.
#pragma once

#include <sys/resource.h>

namespace viwo::testing {

/// MiB. 0 under the address sanitizer, which keeps what is freed, and under that of threads, which
/// keeps who touched it.
inline long peak_mb() {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return 0;
#else
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss / 1024;
#endif
}

}  // namespace viwo::testing
