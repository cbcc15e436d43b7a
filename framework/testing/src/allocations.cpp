#include "allocations.hpp"

#include <atomic>
#include <cstddef>

namespace {
std::atomic<long> count{0};
}

// Eigen calls malloc, so it does not do to replace operator new. Sanitizers need malloc themselves;
// glibc offers the originals under these names.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define VIWO_COUNTS_ALLOCATIONS true
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++count;
  return __libc_malloc(size);
}
void* realloc(void* memory, std::size_t size) {
  ++count;
  return __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++count;
  return __libc_memalign(alignment, size);
}
}
#else
#define VIWO_COUNTS_ALLOCATIONS false
#endif

namespace viwo::testing {

long allocations() { return count; }

bool counts_allocations() { return VIWO_COUNTS_ALLOCATIONS; }

}  // namespace viwo::testing
