// Pose of a body B on the IMU at an instant between two clones, with its derivatives. Equations:
// model.md beside this file.
#pragma once

#include <Eigen/Core>

namespace viwo::pose_reference {

/// Pose of the IMU at a clone, and how it moved there.
struct ClonePose {
  Eigen::Matrix3d R_GtoI = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinG = Eigen::Vector3d::Zero();
  Eigen::Vector3d w_IinI = Eigen::Vector3d::Zero();  ///< rad/s
  Eigen::Vector3d v_IinI = Eigen::Vector3d::Zero();  ///< velocity relative to G, in I, m/s
};

/// Where B sits on the IMU.
struct Lever {
  Eigen::Matrix3d R_ItoB = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_BinI = Eigen::Vector3d::Zero();
};

struct BodyPose {
  Eigen::Matrix3d R_GtoB = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_BinG = Eigen::Vector3d::Zero();
};

/// Derivatives of [orientation, position] by dtheta, dp of the first clone, then of the last one;
/// the error of the orientation is R_GtoB = Exp(-dtheta) R_GtoB_hat.
using BodyJacobian = Eigen::Matrix<double, 6, 12>;

/// B at the part `u` (0 .. 1) of the time `period_s` from the first clone to the last one. Rates
/// and velocities are held in the derivatives.
BodyPose body_between(const ClonePose& first, const ClonePose& last, double period_s, double u,
                      const Lever& lever, BodyJacobian* J = nullptr);

}  // namespace viwo::pose_reference
