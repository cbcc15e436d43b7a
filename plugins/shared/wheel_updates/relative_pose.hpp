// Planar pose of the odometry frame O between two instants, predicted from two poses of the IMU,
// with its derivatives. Equations: model.md of wheel_odometry.
#pragma once

#include <Eigen/Core>

#include "viwo/api/filter_view.hpp"

namespace viwo::wheel_motion {

/// Pose of the IMU at a clone, and how it moved there; wanted `after_s` later.
struct MovingPose {
  Eigen::Matrix3d R_GtoI = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinG = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d w_IinI = Eigen::Vector3d::Zero();  ///< rad/s
  Eigen::Vector3d v_IinI = Eigen::Vector3d::Zero();  ///< velocity relative to G, in I, m/s
  double after_s = 0.;                               ///< small
};

/// Of a clone, at its estimate or at its first estimate; its velocity is turned by the latter.
MovingPose moving_pose(const CloneState& clone, double after_s, bool first_estimate);

/// Where the IMU sits in O.
struct Extrinsics {
  Eigen::Matrix3d R_ItoO = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinO = Eigen::Vector3d::Zero();
};

/// Columns of the Jacobian, each block with three but the last with one.
inline constexpr int kFirstTheta = 0;
inline constexpr int kFirstPosition = 3;
inline constexpr int kLastTheta = 6;
inline constexpr int kLastPosition = 9;
inline constexpr int kMountTheta = 12;
inline constexpr int kMountPosition = 15;
inline constexpr int kTimeOffset = 18;
inline constexpr int kGeometrySize = 19;
using PoseJacobian = Eigen::Matrix<double, 3, kGeometrySize>;

/// [yaw, x, y] of O at `last` in O at `first`: rad, m, m. Yaw in (-pi, pi). `tilt`, if not null,
/// becomes [roll, pitch] that O turns by on the side: the first two entries of the rotation vector
/// that yaw is the last one of.
Eigen::Vector3d relative_pose(const MovingPose& first, const MovingPose& last,
                              const Extrinsics& mount, Eigen::Vector2d* tilt = nullptr);

/// Its derivative by the errors of both poses (R = Exp(-dtheta) R_hat), of the mount, and by the
/// time offset that moves both instants; rates and velocities are held.
PoseJacobian relative_pose_jacobian(const MovingPose& first, const MovingPose& last,
                                    const Extrinsics& mount);

/// Motion of O over an interval.
struct Motion {
  Eigen::Matrix3d M = Eigen::Matrix3d::Identity();  ///< takes vectors from the first O to the last
  Eigen::Vector3d d = Eigen::Vector3d::Zero();      ///< origin of the last O in the first, m
};

/// The motion with constant twist that O made if the wheels measured g = [yaw, x, y] while O turned
/// by `tilt` = [roll, pitch] (rad, in the axes of O) on the side; O moves along its own x-y plane.
Motion complete_motion(const Eigen::Vector3d& g, const Eigen::Vector2d& tilt);

/// The columns of the mount in relative_pose_jacobian(), for a given motion of O.
Eigen::Matrix<double, 3, 6> mount_jacobian(const Motion& motion, const Eigen::Vector3d& p_IinO);

/// Columns of mount and time offset alone.
inline constexpr int kCalibrationSize = kGeometrySize - kMountTheta;
using CalibrationJacobian = Eigen::Matrix<double, 3, kCalibrationSize>;

/// They for the motion `g` = [yaw, x, y] and `tilt` = [roll, pitch] of O, and the change of g when
/// both instants move on, `g_rate` (rad/s, m/s): (WO-12), (WO-13), (WO-14).
CalibrationJacobian calibration_jacobian(const Eigen::Vector3d& g, const Eigen::Vector2d& tilt,
                                         const Eigen::Vector3d& g_rate,
                                         const Eigen::Vector3d& p_IinO);

/// Derivative of [roll, pitch] that O turns by from one clone to the other, where it turns little,
/// by the errors of both clones (WO-6).
Eigen::Matrix<double, 2, kGeometrySize> tilt_jacobian(const MovingPose& first,
                                                      const MovingPose& last,
                                                      const Extrinsics& mount);

}  // namespace viwo::wheel_motion
