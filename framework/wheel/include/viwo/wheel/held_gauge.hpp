// The odometry frame in which the entries that the gauge holds have their values: what is true in
// another frame is moved there, and what is known is.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "viwo/api/rig.hpp"
#include "viwo/wheel/wheel_model.hpp"

namespace viwo {

/// How the intrinsics change with the frame, by yaw (k = 0), x or y of O' in O; nothing where the
/// model's frame cannot be moved like that (KinematicModel::move_frame).
std::optional<Intrinsics> intrinsics_by_frame(const WheelModel& model, const Intrinsics& x_WI,
                                              int k);

/// Rewrites the true calibration of a wheel set (extrinsics and intrinsics) for the odometry frame
/// in which the entries that the gauge holds have the values of `held` (F-12). False, and nothing
/// changed, when the model's frame does not move (KinematicModel::move_frame) or no such frame
/// exists.
bool move_to_held_gauge(const WheelModel& model, const Intrinsics& held, WheelsView& truth);

/// What is known of where something is that moves in O, or in which O moves, when O is moved.
struct MountKnowledge {
  Eigen::Matrix<double, Eigen::Dynamic, 3> by_frame;  ///< its errors by yaw, x, y of O' in O
  Eigen::VectorXd sigma;                              ///< in the frame of the drawing; 0: held
};

/// Of O in a body in the plane, E = [x, y, yaw] (m, m, rad).
MountKnowledge known_of_body(const Eigen::Vector3d& E, const Eigen::Vector3d& sigma);
/// Of the IMU in O: the errors of R_ItoO and p_IinO as the filter has them (rad, m; F-43).
MountKnowledge known_of_imu(const Eigen::Vector3d& p_IinO,
                            const Eigen::Matrix<double, 6, 1>& sigma);

/// Covariance of [x_WI, mount] of which the sigmas about `x_WI` in the frame of the drawing are
/// `sigma` and those of `mount`, once O is moved to where the entries that the gauge holds are what
/// they are there (CAL-18): these have zero variance, and what they are off by is in the others,
/// those of the mount among them but where they are held.
Eigen::MatrixXd prior_in_held_frame(const WheelModel& model, const Intrinsics& x_WI,
                                    const Intrinsics& sigma, const MountKnowledge& mount = {});

/// Of such a covariance; what is held hangs together with nothing.
Eigen::MatrixXd correlation_matrix(const Eigen::MatrixXd& P);

}  // namespace viwo
