#include "anchored_point.hpp"

#include "viwo/math/so3.hpp"

namespace viwo::visual {
namespace {

/// Of 80 degrees.
constexpr double kSmallestCosine = 0.17;

/// Derivative of point_of_inverse_depth() and of inverse_depth_of_point(): the same function.
Eigen::Matrix3d inverse_depth_jacobian(const Eigen::Vector3d& at) {
  const double inverse = 1. / at.z();
  Eigen::Matrix3d J;
  J << inverse, 0., -at.x() * inverse * inverse,  //
      0., inverse, -at.y() * inverse * inverse,   //
      0., 0., -inverse * inverse;
  return J;
}

}  // namespace

Eigen::Vector3d point_of_inverse_depth(const Eigen::Vector3d& landmark) {
  return Eigen::Vector3d(landmark.x(), landmark.y(), 1.) / landmark.z();
}

Eigen::Vector3d inverse_depth_of_point(const Eigen::Vector3d& p_C) {
  return Eigen::Vector3d(p_C.x(), p_C.y(), 1.) / p_C.z();
}

bool can_be_anchored(const Eigen::Vector3d& p_C) { return p_C.z() > kSmallestCosine * p_C.norm(); }

AnchoredPoint::AnchoredPoint(const Anchor& anchor, const Eigen::Vector3d& landmark) {
  const Eigen::Matrix3d R_CtoG = (anchor.R_ItoC * anchor.R_GtoI).transpose();
  const Eigen::Vector3d turned = point_of_inverse_depth(landmark) - anchor.p_IinC;
  const Eigen::Vector3d p_FinI = anchor.R_ItoC.transpose() * turned;
  p_FinG = anchor.R_GtoI.transpose() * p_FinI + anchor.p_IinG;
  by_landmark = R_CtoG * inverse_depth_jacobian(landmark);
  by_clone << -anchor.R_GtoI.transpose() * skew(p_FinI), Eigen::Matrix3d::Identity();
  by_extrinsics << -R_CtoG * skew(turned), -R_CtoG;
}

MovedLandmark::MovedLandmark(const Anchor& from, const Anchor& to,
                             const Eigen::Vector3d& old_landmark) {
  const AnchoredPoint point(from, old_landmark);
  p_C = to.to_camera(point.p_FinG);
  landmark = inverse_depth_of_point(p_C);
  const Eigen::Matrix3d J = inverse_depth_jacobian(p_C);
  const Eigen::Matrix3d J_point = J * to.R_ItoC * to.R_GtoI;
  const Eigen::Vector3d turned = p_C - to.p_IinC;
  by_landmark = J_point * point.by_landmark;
  by_old_clone = J_point * point.by_clone;
  by_new_clone << J * skew(turned) * to.R_ItoC, -J_point;
  by_extrinsics << J * skew(turned), J;
  by_extrinsics += J_point * point.by_extrinsics;
}

}  // namespace viwo::visual
