// The prior of intrinsics in the frame in which the gauge holds some of them.
#pragma once

#include <Eigen/Core>

#include "viwo/wheel/wheel_model.hpp"

namespace viwo::calibration {

/// Covariance of the intrinsics, whose sigmas about `x_WI` in the frame of the drawing are `sigma`,
/// once O is moved to where the entries that the gauge holds are what they are there (CAL-18):
/// these have zero variance, and what they are off by is in the others.
Eigen::MatrixXd prior_in_held_frame(const WheelModel& model, const Intrinsics& x_WI,
                                    const Intrinsics& sigma);

}  // namespace viwo::calibration
