// Whether a filter can go on.
#pragma once

#include <string>

#include "viwo/filter/filter.hpp"

namespace viwo {

/// Why the filter cannot go on; empty as long as it can.
std::string failure_of(const Filter& filter);

}  // namespace viwo
