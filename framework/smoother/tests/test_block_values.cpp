#include <gtest/gtest.h>

#include "block_values.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::smoother {
namespace {

TEST(BlockValues, DifferenceUndoesRetraction) {
  BlockSpec spec;
  spec.name = "pose";
  spec.add_rotation({"a", "b", "c"}, exp_so3({0.3, -0.2, 0.9}), Eigen::Vector3d::Ones());
  spec.add("x", "m", 1.5, 1.);
  spec.add("y", "m", -0.5, 1.);
  Eigen::VectorXd dx(5);
  dx << 0.02, -0.01, 0.3, 0.25, -2.;
  std::vector<double> value = spec.value;
  retract(spec, dx, value);
  EXPECT_LT((difference(spec, value, spec.value) - dx).norm(), 1e-12);
  // R = Exp(-dtheta) R_hat, as in a filter.
  const Eigen::Map<const Eigen::Matrix3d> R(value.data()), R_hat(spec.value.data());
  EXPECT_LT((R - exp_so3(-dx.head<3>()) * R_hat).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(value[9], 1.75);
}

}  // namespace
}  // namespace viwo::smoother
