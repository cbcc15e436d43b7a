// Pairs of poses at the same time: the reference is interpolated at the stamps of the estimate.
#pragma once

#include <cstdint>
#include <vector>

#include "viwo/math/trajectory.hpp"

namespace viwo::eval {

/// Reference and estimate at one stamp. Their worlds may differ (see alignment.hpp).
struct PosePair {
  StampedPose reference;
  StampedPose estimate;
};

/// Pairs in time order, and what had to be left out.
struct Association {
  std::vector<PosePair> pairs;  ///< never empty
  std::int64_t n_outside = 0;   ///< poses of the estimate before or after the reference
  std::int64_t n_in_gap = 0;    ///< poses of the estimate in a gap of the reference
};

/// Interpolates the reference at every stamp of the estimate. Between reference stamps that are
/// more than `max_gap_s` apart nothing is interpolated. Throws InputError when a trajectory is
/// empty, has stamps that do not increase, values that are not finite or quaternions without unit
/// norm, and when no pair is found.
Association associate(const Trajectory& reference, const Trajectory& estimate, double max_gap_s);

}  // namespace viwo::eval
