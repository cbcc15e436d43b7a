// How often the process has allocated with new: link allocations.cpp.
#pragma once

namespace viwo::testing {

long allocations();

}  // namespace viwo::testing
