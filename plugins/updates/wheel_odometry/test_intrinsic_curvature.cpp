// What derivatives at a wrong linearisation point leave, against draws of it.
#include <random>

#include <gtest/gtest.h>

#include "calibration_runs.hpp"
#include "intrinsic_curvature.hpp"

namespace viwo::wheel_odometry {
namespace {

constexpr std::int64_t kMs = 1'000'000;

class Circle : public ::testing::Test {
 protected:
  Circle() : model_(testing::load_model(testing::swerve("four_wis_wid"))) {
    const sim::PlanarMotion motion("circle", {.ramp_s = 0.});
    sim::EncoderSimulation simulation;
    simulation.duration_s = 2.;
    simulation.noise = false;
    encoders_ = sim::simulate_encoders(model_->model(), model_->nominal(), motion, simulation, 1);
    options_.twist.noise_weighted = true;
    options_.twist.fitted_jacobian = true;
    const int n = model_->n_intrinsics();
    P_ = IntrinsicMatrix::Zero(n, n);
    for (int i = 0; i < n; ++i) {
      const double sigma =
          0.3 * model_->description().intrinsics[static_cast<std::size_t>(i)].prior_sigma;
      P_(i, i) = sigma * sigma;
    }
  }

  PreintegratedPose at(const Intrinsics& x_WI) const {
    Preintegrator preintegrator(model_, options_);
    preintegrator.move_intrinsics(x_WI);
    PreintegratedPose pose;
    EXPECT_TRUE(preintegrator.integrate(encoders_, 1000 * kMs, 1100 * kMs, pose));
    return pose;
  }

  Eigen::Matrix3d noise(IntrinsicCurvature& curvature, const IntrinsicMatrix& P,
                        double wander_time_s = 0.) const {
    const Intrinsics x = model_->nominal();
    return curvature.noise(encoders_, 1000 * kMs, 1100 * kMs, x, P, wander_time_s, at(x));
  }

  std::shared_ptr<const WheelModel> model_;
  std::vector<EncoderSample> encoders_;
  PreintegrationOptions options_;
  IntrinsicMatrix P_;
};

TEST_F(Circle, NoiseIsTheScatterThatDerivativesLeaveAtAWrongPoint) {
  IntrinsicCurvature curvature;
  curvature.start(model_, options_);
  const Eigen::Matrix3d C = noise(curvature, P_);

  std::mt19937_64 rng(3);
  std::normal_distribution<double> gauss;
  const Intrinsics x = model_->nominal();
  const PreintegratedPose pose = at(x);
  constexpr int kDraws = 4000;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (int k = 0; k < kDraws; ++k) {
    Intrinsics d = P_.diagonal().cwiseSqrt();
    for (double& value : d) value *= gauss(rng);
    const PreintegratedPose off = at(x + d);
    const Eigen::Vector3d left = off.g - pose.g - off.J_g_WI * d;
    sum += left;
    squares += left * left.transpose();
  }
  const Eigen::Vector3d mean = sum / kDraws;
  const Eigen::Matrix3d scatter = squares / kDraws - mean * mean.transpose();
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(C(a, a), scatter(a, a), 0.15 * scatter(a, a)) << a;
    EXPECT_GT(C(a, a), 0.1 * pose.P_g(a, a)) << a;  // worth having
  }
}

TEST_F(Circle, IsCommonToAllIntervals) {
  IntrinsicCurvature curvature;
  curvature.start(model_, options_);
  const Eigen::Matrix3d first = noise(curvature, P_);
  noise(curvature, P_);
  EXPECT_TRUE(noise(curvature, P_).isApprox(3. * first, 1e-12));
  curvature.start(model_, options_);
  EXPECT_TRUE(noise(curvature, P_).isApprox(first, 1e-12));
}

TEST_F(Circle, IsCommonForAsLongAsNothingWanders) {
  IntrinsicCurvature curvature;
  curvature.start(model_, options_);
  const Eigen::Matrix3d first = noise(curvature, P_, 0.2);
  for (int k = 0; k < 5; ++k) noise(curvature, P_, 0.2);
  EXPECT_TRUE(noise(curvature, P_, 0.2).isApprox(3. * first, 1e-6));
}

TEST_F(Circle, IsNotLookedForWhereItIsNegligible) {
  IntrinsicCurvature curvature;
  curvature.start(model_, options_);
  EXPECT_TRUE(noise(curvature, 1e-4 * P_).isZero(0.));
  for (int k = 0; k < 5; ++k) EXPECT_TRUE(noise(curvature, P_).isZero(0.)) << k;
  EXPECT_FALSE(noise(curvature, P_).isZero(0.));
  EXPECT_TRUE(noise(curvature, IntrinsicMatrix()).isZero(0.));
}

}  // namespace
}  // namespace viwo::wheel_odometry
