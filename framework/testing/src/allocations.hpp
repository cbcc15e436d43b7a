// How often the process has asked for memory: link viwo_allocation_counter.
#pragma once

namespace viwo::testing {

/// Calls of malloc, realloc and aligned_alloc so far, of all threads; new and Eigen call these.
long allocations();

/// False under a sanitizer, which has its own: then allocations() is 0 for ever.
bool counts_allocations();

}  // namespace viwo::testing
