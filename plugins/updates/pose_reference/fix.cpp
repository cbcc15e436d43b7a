#include "fix.hpp"

#include <cstddef>

#include "viwo/math/so3.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo::pose_reference {

using Eigen::Matrix3d;
using Eigen::Vector3d;

ClonePose at_estimate(const CloneState& clone) {
  // The velocity is held in I, as it was when the clone was made.
  return {clone.R_GtoI, clone.p_IinG, clone.w_IinI, clone.R_GtoI_fej * clone.v_IinG};
}

ClonePose at_first_estimate(const CloneState& clone) {
  ClonePose pose = at_estimate(clone);
  pose.R_GtoI = clone.R_GtoI_fej;
  pose.p_IinG = clone.p_IinG_fej;
  return pose;
}

std::optional<Bracket> Brackets::around(std::span<const CloneState> clones, std::int64_t t_ns,
                                        double max_span_s) {
  if (clones.size() < 2 || t_ns < clones.front().t_ns || t_ns > clones.back().t_ns) {
    too_late_.add(1, t_ns);
    return std::nullopt;
  }
  std::size_t i = clones.size() - 1;
  while (i > 1 && clones[i - 1].t_ns >= t_ns) --i;
  const CloneState &first = clones[i - 1], &last = clones[i];
  const double period_s = seconds_between(first.t_ns, last.t_ns);
  if (period_s > max_span_s) {
    too_far_.add(1, t_ns);
    return std::nullopt;
  }
  return Bracket{first, last, period_s, seconds_between(first.t_ns, t_ns) / period_s};
}

void Brackets::append_to(std::vector<RejectionCount>& out) const {
  too_late_.append_to(out);
  too_far_.append_to(out);
}

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
