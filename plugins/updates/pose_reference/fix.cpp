#include "fix.hpp"

#include "viwo/math/so3.hpp"

namespace viwo::pose_reference {

using Eigen::Matrix3d;
using Eigen::Vector3d;

BodyPose body_between(const ClonePose& first, const ClonePose& last, double period_s, double u,
                      const Lever& lever, BodyJacobian* J) {
  // (PR-1)
  const double h = u * u * (3. - 2. * u);
  const double g0 = u * (1. - u) * (1. - u);
  const double g1 = -u * u * (1. - u);

  // (PR-2)
  const Vector3d phi = log_so3(last.R_GtoI * first.R_GtoI.transpose());
  const Vector3d psi = h * phi - period_s * (g0 * first.w_IinI + g1 * last.w_IinI);
  const Matrix3d E = exp_so3(psi);
  const Matrix3d R_GtoI = E * first.R_GtoI;
  // (PR-3)
  const Vector3d v0 = period_s * g0 * first.v_IinI;
  const Vector3d v1 = period_s * g1 * last.v_IinI;
  const Matrix3d R_I0toG = first.R_GtoI.transpose();
  const Matrix3d R_I1toG = last.R_GtoI.transpose();
  const Vector3d p_IinG = (1. - h) * first.p_IinG + h * last.p_IinG + R_I0toG * v0 + R_I1toG * v1;
  // (PR-4)
  const BodyPose body{lever.R_ItoB * R_GtoI, p_IinG + R_GtoI.transpose() * lever.p_BinI};
  if (J == nullptr) return body;

  // (PR-5)
  const Matrix3d left = h * right_jacobian_so3(-psi);
  const Matrix3d turn0 = E - left * right_jacobian_inverse_so3(phi);
  const Matrix3d turn1 = left * right_jacobian_inverse_so3(-phi);
  // (PR-6)
  const Matrix3d by_turn = -R_GtoI.transpose() * skew(lever.p_BinI);
  J->setZero();
  J->block<3, 3>(0, 0) = lever.R_ItoB * turn0;
  J->block<3, 3>(0, 6) = lever.R_ItoB * turn1;
  J->block<3, 3>(3, 0) = by_turn * turn0 - R_I0toG * skew(v0);
  J->block<3, 3>(3, 3).diagonal().setConstant(1. - h);
  J->block<3, 3>(3, 6) = by_turn * turn1 - R_I1toG * skew(v1);
  J->block<3, 3>(3, 9).diagonal().setConstant(h);
  return body;
}

}  // namespace viwo::pose_reference
