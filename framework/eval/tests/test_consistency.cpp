#include <random>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "viwo/eval/consistency.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::eval {
namespace {

using Vector12 = Eigen::Matrix<double, 12, 1>;
using Matrix12 = Eigen::Matrix<double, 12, 12>;

/// Two poses with errors drawn from a covariance, and what the NEES is against `claimed`.
double mean_relative_nees(const Matrix12& cov, const Matrix12& claimed, int runs) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const Matrix12 L = cov.llt().matrixL();
  double sum = 0.;
  for (int run = 0; run < runs; ++run) {
    const auto drawn = [&](double scale) -> Eigen::Vector3d {
      return scale * Eigen::Vector3d(normal(random), normal(random), normal(random));
    };
    ErringPose from{exp_so3(drawn(1.)), {}, drawn(100.), {}};
    ErringPose to{exp_so3(drawn(1.)), {}, from.p_IinG + drawn(1.), {}};
    const Vector12 error = L * Vector12::NullaryExpr([&] { return normal(random); });
    to.R_GtoI_true = exp_so3(-error.segment<3>(0)) * to.R_GtoI;
    to.p_IinG_true = to.p_IinG + error.segment<3>(3);
    from.R_GtoI_true = exp_so3(-error.segment<3>(6)) * from.R_GtoI;
    from.p_IinG_true = from.p_IinG + error.segment<3>(9);
    sum += relative_nees(from, to, claimed);
  }
  return sum / runs;
}

/// Errors of two poses that have next to all of them in common, as a start leaves them.
Matrix12 covariance() {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const Matrix12 A = Matrix12::NullaryExpr([&] { return normal(random); });
  Matrix12 both = 1e-6 * A * A.transpose();
  Eigen::Matrix<double, 12, 6> common;
  common << Eigen::Matrix<double, 6, 6>::Identity(), Eigen::Matrix<double, 6, 6>::Identity();
  both += 1e-4 * common * common.transpose();
  return both;
}

TEST(RelativeNees, IsSixForErrorsOfTheirCovariance) {
  constexpr int kRuns = 2000;
  const NeesBounds bounds = mean_nees_bounds(6, kRuns, 0.99);
  const double mean = mean_relative_nees(covariance(), covariance(), kRuns);
  EXPECT_GT(mean, bounds.low);
  EXPECT_LT(mean, bounds.high);
}

TEST(RelativeNees, SeesACovarianceThatIsTooSmall) {
  const NeesBounds bounds = mean_nees_bounds(6, 200, 0.99);
  EXPECT_GT(mean_relative_nees(covariance(), 0.64 * covariance(), 200), bounds.high);
}

TEST(RelativeNees, DoesNotSeeWhereAllOfItIs) {
  ErringPose from{exp_so3({0.1, 0.2, 0.3}), {}, {1., 2., 3.}, {}};
  ErringPose to{exp_so3({0.3, -0.2, 0.5}), {}, {2., 2., 3.}, {}};
  const Eigen::Matrix3d turned = exp_so3({0., 0., 1.});
  for (ErringPose* pose : {&from, &to}) {
    pose->R_GtoI_true = pose->R_GtoI * turned.transpose();
    pose->p_IinG_true = turned * pose->p_IinG + Eigen::Vector3d(5., 6., 7.);
  }
  EXPECT_NEAR(relative_nees(from, to, covariance()), 0., 1e-9);
}

}  // namespace
}  // namespace viwo::eval
