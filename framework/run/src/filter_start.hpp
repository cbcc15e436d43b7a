// How a run of the filter comes to its first state.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "viwo/run/run.hpp"

namespace viwo {

/// Tells the estimator where, or how, to start; at a reference state not before `from_ns`.
/// InputError when the run lacks what that needs.
void start(Estimator& estimator, const RunSetup& run, const RunData& data,
           std::int64_t from_ns = std::numeric_limits<std::int64_t>::min());

/// R_GtoI of a reference state.
Eigen::Matrix3d R_GtoI(const StateSample& state);

}  // namespace viwo
