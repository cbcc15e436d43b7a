// Directions of the intrinsics that the data do not determine.
#pragma once

#include <vector>

#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {

/// Directions whose posterior sigma is more than 0.7 of the prior's: the data say less than it. `P`
/// is the posterior covariance of the intrinsics `free`, whitened by the prior: u = root w are they
/// in units of their prior sigmas, w has covariance 1 before the data.
std::vector<UndeterminedDirection> undetermined_of(const Eigen::MatrixXd& P,
                                                   const Eigen::MatrixXd& root,
                                                   const std::vector<int>& free,
                                                   const std::vector<IntrinsicSpec>& specs);

}  // namespace viwo::calibration
