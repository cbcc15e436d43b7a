// The planar pose of the odometry frame O between two clones of the IMU, as the state predicts it,
// with its derivatives: the paper's h, taken over from the differential drive. Equations: model.md
// beside this file.
#pragma once

#include <Eigen/Core>

namespace viwo::wheel_relative_pose {

/// Pose of the IMU at a clone, and how it moved there.
struct ClonePose {
  Eigen::Matrix3d R_GtoI = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinG = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d w_IinI = Eigen::Vector3d::Zero();  ///< rad/s
  Eigen::Vector3d v_IinG = Eigen::Vector3d::Zero();  ///< m/s
};

/// Where the IMU sits in O.
struct Mount {
  Eigen::Matrix3d R_ItoO = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinO = Eigen::Vector3d::Zero();  ///< m
};

/// Columns of the Jacobian: three each, the last has one.
inline constexpr int kFirstTheta = 0;
inline constexpr int kFirstPosition = 3;
inline constexpr int kLastTheta = 6;
inline constexpr int kLastPosition = 9;
inline constexpr int kMountTheta = 12;
inline constexpr int kMountPosition = 15;
inline constexpr int kTimeOffset = 18;
inline constexpr int kPredictionSize = 19;
using PredictionJacobian = Eigen::Matrix<double, 3, kPredictionSize>;

/// h = [yaw, x, y] of O at `last` in O at `first` (RP-7): rad, m, m; yaw in (-pi, pi).
Eigen::Vector3d predict(const ClonePose& first, const ClonePose& last, const Mount& mount);

/// Its derivatives (RP-8) by the errors of both poses (R = Exp(-dtheta) R_hat) and of the mount,
/// and by the time offset, with which both poses move on as the IMU moved.
PredictionJacobian prediction_jacobian(const ClonePose& first, const ClonePose& last,
                                       const Mount& mount);

}  // namespace viwo::wheel_relative_pose
