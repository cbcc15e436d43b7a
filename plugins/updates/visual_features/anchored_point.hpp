// A landmark by its inverse depth in a camera at a clone, its anchor: alpha = x / z, beta = y / z
// and rho = 1 / z, whose errors are nearly Gaussian however little parallax it has.
#pragma once

#include <Eigen/Core>

namespace viwo::visual {

using PoseJacobian = Eigen::Matrix<double, 3, 6>;  ///< by dtheta, dp

/// The IMU at the time of a clone, and a camera on it.
struct Anchor {
  Eigen::Matrix3d R_GtoI, R_ItoC;
  Eigen::Vector3d p_IinG, p_IinC;

  Eigen::Vector3d to_camera(const Eigen::Vector3d& p_FinG) const {
    return R_ItoC * (R_GtoI * (p_FinG - p_IinG)) + p_IinC;
  }
};

/// Point in the camera with these alpha, beta, rho; and back (VF-16).
Eigen::Vector3d point_of_inverse_depth(const Eigen::Vector3d& landmark);
Eigen::Vector3d inverse_depth_of_point(const Eigen::Vector3d& p_C);
/// Far enough in front of the camera to be an anchored landmark: less than 80 degrees off its axis.
bool can_be_anchored(const Eigen::Vector3d& p_C);

/// Where a landmark is, and what that depends on (VF-17).
struct AnchoredPoint {
  Eigen::Vector3d p_FinG;
  Eigen::Matrix3d by_landmark;
  PoseJacobian by_clone, by_extrinsics;  ///< of the anchor

  AnchoredPoint(const Anchor& anchor, const Eigen::Vector3d& landmark);
};

/// A landmark of one anchor as that of another one of the same camera, and what it depends on then
/// (VF-19).
struct MovedLandmark {
  Eigen::Vector3d p_C;       ///< in the new anchor's camera
  Eigen::Vector3d landmark;  ///< meaningless unless can_be_anchored(p_C)
  Eigen::Matrix3d by_landmark;
  PoseJacobian by_old_clone, by_new_clone, by_extrinsics;

  MovedLandmark(const Anchor& from, const Anchor& to, const Eigen::Vector3d& old_landmark);
};

}  // namespace viwo::visual
