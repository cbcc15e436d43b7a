// What noise teaches about the intrinsics where there is no motion: nothing.
#include <cmath>
#include <cstdint>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "viwo/wheel/preintegration.hpp"
#include "wheel_fixture.hpp"

namespace viwo {
namespace {

using testing::load_model;
using testing::sample_motion;
using testing::swerve;

constexpr std::int64_t kDurationNs = 10'000'000'000;

/// What noisy encoders of a base that moves so say about the intrinsics in ten seconds.
PreintegratedPose with_noise_of(const Twist& xi, double motion_sigmas) {
  const auto model = load_model(swerve("four_wis_wid"));
  const auto clean = sample_motion(
      *model, [&](double) { return xi; }, 10., 100.);
  std::mt19937_64 rng(3);
  std::vector<EncoderSample> samples;
  std::normal_distribution<double> gauss;
  for (EncoderSample y : clean) {
    for (const NoiseSpec& noise : model->description().noises) {
      const auto channel = static_cast<std::size_t>(noise.channel);
      const double n = noise.sigma * gauss(rng);
      if (noise.kind == NoiseKind::kDrive) y.drive_rad_per_s[channel] += n;
      if (noise.kind == NoiseKind::kSteer) y.steer_rad[channel] += n;
    }
    samples.push_back(y);
  }
  PreintegrationOptions options;
  options.twist = {.noise_weighted = true, .fitted_jacobian = true, .motion_sigmas = motion_sigmas};
  Preintegrator preintegrator(model, options);
  PreintegratedPose pose;
  EXPECT_TRUE(preintegrator.integrate(samples, 0, kDurationNs, pose));
  return pose;
}

TEST(MotionOrNoise, OfABaseAtRestTeachesNothingAboutItsWheels) {
  const PreintegratedPose parked = with_noise_of(Twist::Zero(), 5.);
  EXPECT_TRUE(parked.J_g_WI.isZero());
  EXPECT_TRUE(parked.parity.Lambda.isZero());
  EXPECT_TRUE(parked.parity.eta.isZero());
  EXPECT_GT(parked.parity.chi2, 0.);
  // What the noise alone would have said.
  const PreintegratedPose misled = with_noise_of(Twist::Zero(), 0.);
  EXPECT_FALSE(misled.J_g_WI.isZero());
  EXPECT_GT(misled.parity.Lambda.trace(), 0.);
  EXPECT_EQ(parked.g, misled.g);
  EXPECT_EQ(parked.P_g, misled.P_g);
}

TEST(MotionOrNoise, TakesAMotionThatOnlyTheMeanOfTheSamplesShowsForMotion) {
  const PreintegratedPose parked = with_noise_of(Twist::Zero(), 5.);
  const double sigma = std::sqrt(parked.P_g(0, 0) / 10. / 0.01);  // rad/s, of a sample
  const Twist creeping(0., 0., sigma);                            // a thousand samples show it
  EXPECT_GT(with_noise_of(creeping, 5.).parity.Lambda.trace(), 0.);
}

/// Sum of what is said about the intrinsics whose name begins so, by themselves.
double told(const PreintegratedPose& pose, const std::string& name) {
  const auto model = load_model(swerve("four_wis_wid"));
  double sum = 0.;
  for (int i = 0; i < model->n_intrinsics(); ++i) {
    const std::string& own = model->description().intrinsics[static_cast<std::size_t>(i)].name;
    if (own.rfind(name, 0) == 0) sum += pose.parity.Lambda(i, i);
  }
  return sum;
}

TEST(MotionOrNoise, OfAStraightLineTeachesNothingAboutWhereTheWheelsAre) {
  const Twist straight(0.5, 0., 0.);
  const PreintegratedPose pose = with_noise_of(straight, 5.);
  const PreintegratedPose misled = with_noise_of(straight, 0.);
  for (const char* where : {"x_", "y_"}) {
    EXPECT_EQ(told(pose, where), 0.);
    EXPECT_GT(told(misled, where), 0.);
  }
  for (const char* what : {"r_", "delta_o"}) {
    EXPECT_NEAR(told(pose, what) / told(misled, what), 1., 1e-3);
  }
  EXPECT_EQ(pose.J_g_WI, misled.J_g_WI);
  EXPECT_EQ(pose.g, misled.g);
}

TEST(MotionOrNoise, TakesASlightTurnThatOnlyTheMeanOfTheSamplesShowsForATurn) {
  const PreintegratedPose straight = with_noise_of({0.5, 0., 0.}, 5.);
  const double sigma = std::sqrt(straight.P_g(0, 0) / 10. / 0.01);  // rad/s, of a sample
  const PreintegratedPose turning = with_noise_of({0.5, 0., sigma}, 5.);
  const PreintegratedPose misled = with_noise_of({0.5, 0., sigma}, 0.);
  // Half of what the single readings seem to say is their noise.
  EXPECT_NEAR(told(turning, "y_") / told(misled, "y_"), 0.5, 0.1);
}

TEST(MotionOrNoise, OfAGeneralMotionIsTheSameWithAndWithoutALimitOnMotion) {
  const Twist xi(0.4, -0.2, 0.6);
  const PreintegratedPose a = with_noise_of(xi, 5.), b = with_noise_of(xi, 0.);
  EXPECT_EQ(a.J_g_WI, b.J_g_WI);
  EXPECT_EQ(a.parity.Lambda, b.parity.Lambda);
  EXPECT_EQ(a.parity.eta, b.parity.eta);
}

}  // namespace
}  // namespace viwo
