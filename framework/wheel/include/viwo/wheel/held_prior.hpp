// The prior of intrinsics in the frame in which the gauge holds some of them.
#pragma once

#include <Eigen/Core>

#include "viwo/wheel/wheel_model.hpp"

namespace viwo {

/// Covariance of [x_WI, E], E = [x, y, yaw] of O in the body of poses (m, m, rad), whose sigmas
/// about `x_WI` and `extrinsics` in the frame of the drawing are `sigma` and `extrinsics_sigma`,
/// once O is moved to where the entries that the gauge holds are what they are there (CAL-18):
/// these have zero variance, and what they are off by is in the others, E among them unless its
/// sigmas are all zero.
Eigen::MatrixXd prior_in_held_frame(
    const WheelModel& model, const Intrinsics& x_WI, const Intrinsics& sigma,
    const Eigen::Vector3d& extrinsics = Eigen::Vector3d::Zero(),
    const Eigen::Vector3d& extrinsics_sigma = Eigen::Vector3d::Zero());

}  // namespace viwo
