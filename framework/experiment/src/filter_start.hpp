// How a run of the filter comes to its first state.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "viwo/experiment/run.hpp"

namespace viwo::experiment {

/// What starts without a reference want to see beside the IMU: encoder samples of each wheel set,
/// then the tracks that updates take, if any do. `streams`: those that updates take.
std::vector<ExtraStream> start_streams(const FilterSetup& setup,
                                       std::span<const SharedStream> streams);

/// Tells the estimator where, or how, to start; at a reference state not before `from_ns`.
/// InputError when the run lacks what that needs.
void start(Estimator& estimator, const RunSetup& run, const RunData& data,
           std::int64_t from_ns = std::numeric_limits<std::int64_t>::min());

/// R_GtoI of a reference state.
Eigen::Matrix3d R_GtoI(const StateSample& state);

}  // namespace viwo::experiment
