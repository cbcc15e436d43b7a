// When the robot stood still.
#pragma once

#include <cstddef>
#include <vector>

#include "viwo/series/recording.hpp"

namespace viwo::series {

/// Readings [first, last) of the IMU, without a gap.
struct Rest {
  std::size_t first = 0, last = 0;
};

/// Rests of at least a second, as wheels say it, or, without wheels, readings whose means over a
/// tenth of a second hardly change. The longest first.
std::vector<Rest> rests_of(const Recording& recording);

}  // namespace viwo::series
