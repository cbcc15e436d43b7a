#include "block_values.hpp"

#include "viwo/math/so3.hpp"

namespace viwo::smoother {

void retract(const BlockSpec& spec, const Eigen::Ref<const Eigen::VectorXd>& dx,
             std::vector<double>& value) {
  for (int k = 0; k < spec.rotations; ++k) {
    Eigen::Map<Eigen::Matrix3d> R(value.data() + 9 * k);
    R = normalized_rotation(exp_so3(-dx.segment<3>(3 * k)) * R);
  }
  for (Eigen::Index i = 3 * spec.rotations; i < dx.size(); ++i) {
    value[static_cast<std::size_t>(i + 6 * spec.rotations)] += dx[i];
  }
}

Eigen::VectorXd difference(const BlockSpec& spec, const std::vector<double>& to,
                           const std::vector<double>& from) {
  Eigen::VectorXd dx(static_cast<Eigen::Index>(spec.entries.size()));
  for (int k = 0; k < spec.rotations; ++k) {
    const Eigen::Map<const Eigen::Matrix3d> R1(to.data() + 9 * k), R0(from.data() + 9 * k);
    dx.segment<3>(3 * k) = -log_so3(R1 * R0.transpose());
  }
  for (Eigen::Index i = 3 * spec.rotations; i < dx.size(); ++i) {
    const auto n = static_cast<std::size_t>(i + 6 * spec.rotations);
    dx[i] = to[n] - from[n];
  }
  return dx;
}

}  // namespace viwo::smoother
