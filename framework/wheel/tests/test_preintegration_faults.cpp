// Preintegration of samples that are missing, that slip or are not finite, and of a base at rest.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "viwo/wheel/preintegration.hpp"
#include "wavy_motion.hpp"
#include "wheel_fixture.hpp"

namespace viwo {
namespace {

using testing::load_model;
using testing::sample_motion;
using testing::swerve;

TEST(Preintegration, SaysWhenTheSamplesDoNotReachOverTheInterval) {
  const auto model = load_model(swerve("four_wis_wid"));
  const auto samples = sample_motion(*model, wavy, 1., 100.);
  Preintegrator preintegrator(model, {});
  PreintegratedPose pose;
  EXPECT_FALSE(preintegrator.integrate(samples, -kSecond, kSecond / 2, pose));
  EXPECT_NEAR(pose.duration_s, 0.5, 1e-12);
  EXPECT_FALSE(preintegrator.integrate(samples, kSecond / 2, 2 * kSecond, pose));
  EXPECT_FALSE(preintegrator.integrate(samples, 5 * kSecond, 6 * kSecond, pose));
  EXPECT_EQ(pose.samples, 0);
  EXPECT_FALSE(preintegrator.integrate({}, 0, kSecond, pose));
}

TEST(Preintegration, BridgesAHoleAndSaysHowLong) {
  const auto model = load_model(swerve("four_wis_wid"));
  auto samples = sample_motion(*model, wavy, 1., 100.);
  Preintegrator preintegrator(model, {});
  PreintegratedPose whole, holed;
  ASSERT_TRUE(preintegrator.integrate(samples, 0, kSecond, whole));
  samples.erase(samples.begin() + 40, samples.begin() + 45);
  ASSERT_TRUE(preintegrator.integrate(samples, 0, kSecond, holed));
  EXPECT_NEAR(holed.bridged_s, 0.05, 1e-12);
  EXPECT_NEAR(holed.duration_s, 1., 1e-12);
  EXPECT_EQ(holed.samples, 95);
  EXPECT_LT((holed.g - whole.g).norm(), 1e-4);
}

TEST(Preintegration, BridgesIntervalsThatBeginOrLieInAHole) {
  const auto model = load_model(swerve("four_wis_wid"));
  auto samples = sample_motion(*model, wavy, 1., 100.);
  samples.erase(samples.begin() + 40, samples.begin() + 60);
  Preintegrator preintegrator(model, {});
  PreintegratedPose whole, total, part;
  ASSERT_TRUE(preintegrator.integrate(samples, 0, kSecond, whole));
  total.reset(16);
  for (int k = 0; k < 20; ++k) {
    ASSERT_TRUE(preintegrator.integrate(samples, k * kSecond / 20, (k + 1) * kSecond / 20, part));
    append(total, part);
  }
  EXPECT_NEAR(total.bridged_s, 0.2, 1e-12);
  EXPECT_NEAR(total.duration_s, 1., 1e-12);
  EXPECT_EQ(total.samples, 80);
  EXPECT_LT((total.g - whole.g).norm(), 1e-12);
}

TEST(Preintegration, CountsEverySampleOnceOverIntervalsThatCutThem) {
  const auto model = load_model(swerve("four_wis_wid"));
  const auto samples = sample_motion(*model, wavy, 1., 100.);
  Preintegrator preintegrator(model, {});
  PreintegratedPose part;
  std::int64_t count = 0;
  for (int k = 0; k < 30; ++k) {
    const auto at = [](int i) { return static_cast<std::int64_t>(i) * kSecond / 30; };
    ASSERT_TRUE(preintegrator.integrate(samples, at(k), at(k + 1), part));
    count += part.samples;
  }
  EXPECT_EQ(count, 100);
}

TEST(Preintegration, DoesNotBelieveASlippingWheel) {
  const auto model = load_model(swerve("four_wis_wid"));
  const auto clean = sample_motion(*model, wavy, 1., 100.);
  auto slipping = clean;
  for (std::size_t i = 30; i < 40; ++i) slipping[i].drive_rad_per_s[1] *= 1.5;
  Preintegrator gated(model, {.twist = {}, .parity_gate_probability = 1e-4});
  Preintegrator open(model, {});
  PreintegratedPose truth, with_gate, without;
  gated.integrate(clean, 0, kSecond, truth);
  EXPECT_EQ(truth.gated, 0);
  gated.integrate(slipping, 0, kSecond, with_gate);
  open.integrate(slipping, 0, kSecond, without);
  EXPECT_EQ(with_gate.gated, 10);
  EXPECT_NEAR(with_gate.bridged_s, 0.1, 1e-12);
  EXPECT_EQ(without.gated, 0);
  EXPECT_LT((with_gate.g - truth.g).norm(), 0.5 * (without.g - truth.g).norm());
  // What was bridged is less certain than what was measured.
  EXPECT_GT(with_gate.P_g.trace(), 2. * without.P_g.trace());
}

// An update integrates its interval again at other intrinsics.
TEST(Preintegration, IsTheSameAgainWhereItsFirstSampleIsNotBelieved) {
  const auto model = load_model(swerve("four_wis_wid"));
  const auto even = [](double) { return Twist(0.4, 0.1, 0.3); };
  const auto whole = sample_motion(*model, even, 1., 100.);
  auto samples = whole;
  for (const std::size_t bad : {30, 31, 60}) samples[bad].drive_rad_per_s.fill(std::nan(""));
  Preintegrator preintegrator(model, {});
  PreintegratedPose clean, once, again;
  Preintegrator(model, {}).integrate(whole, 3 * kSecond / 10, 6 * kSecond / 10, clean);
  const auto expect_all_of_it = [&](const PreintegratedPose& pose, double bridged_s) {
    EXPECT_NEAR(pose.bridged_s, bridged_s, 1e-12);
    EXPECT_NEAR(pose.duration_s, 0.3, 1e-12);
    EXPECT_LT((pose.g - clean.g).norm(), 1e-9);
  };
  // With nothing before it, and behind another one.
  for (const bool is_behind : {false, true}) {
    if (is_behind) preintegrator.integrate(samples, 0, 3 * kSecond / 10, once);
    ASSERT_TRUE(preintegrator.integrate(samples, 3 * kSecond / 10, 6 * kSecond / 10, once));
    ASSERT_TRUE(preintegrator.integrate(samples, 3 * kSecond / 10, 6 * kSecond / 10, again));
    expect_all_of_it(once, 0.02);
    EXPECT_EQ(again.g, once.g);
    EXPECT_EQ(again.P_g, once.P_g);
  }
  // The next one goes on from there.
  ASSERT_TRUE(preintegrator.integrate(samples, 6 * kSecond / 10, 9 * kSecond / 10, once));
  expect_all_of_it(once, 0.01);
}

// A cut sample is noisier than one that is whole: the gate has to know.
TEST(Preintegration, GatesCutSamplesAsOftenAsItIsAskedTo) {
  const auto model = load_model(swerve("four_wis_wid"));
  constexpr double kSeconds = 400., kRate_hz = 25., kProbability = 0.01;
  const auto even = [](double) { return Twist(0.4, 0.1, 0.3); };  // pieces of it fit as samples do
  std::mt19937_64 rng(5);
  std::vector<EncoderSample> noisy;
  for (const EncoderSample& clean : sample_motion(*model, even, kSeconds, kRate_hz)) {
    noisy.push_back(testing::with_noise(*model, even(0.), clean, 1., rng));
  }
  Preintegrator gated(model, {.twist = {}, .parity_gate_probability = kProbability});
  const auto gated_of = [&](std::int64_t period_ns, std::int64_t offset_ns) {
    std::int64_t n = 0;
    PreintegratedPose part;
    for (std::int64_t t = kSecond + offset_ns; t < 399 * kSecond; t += period_ns) {
      gated.integrate(noisy, t, t + period_ns, part);
      n += part.gated;
    }
    return static_cast<double>(n);
  };
  // Of a thousand times ten, and three sigma of their number.
  const double n = 398. * kRate_hz, sigma = std::sqrt(n * kProbability);
  EXPECT_NEAR(gated_of(kSecond, 0), n * kProbability, 3. * sigma);
  EXPECT_NEAR(gated_of(kSecond / 30, 7'000'000), n * kProbability, 3. * sigma);
}

TEST(Preintegration, CountsWhatItLeavesOutBySamplesNotByPieces) {
  const auto model = load_model(swerve("four_wis_wid"));
  auto samples = sample_motion(*model, wavy, 1., 100.);
  samples[50].drive_rad_per_s[0] = std::nan("");
  samples.erase(samples.begin() + 48, samples.begin() + 50);  // a hole before it
  Preintegrator preintegrator(model, {});
  PreintegratedPose pose;
  ASSERT_TRUE(preintegrator.integrate(samples, 0, kSecond, pose));
  EXPECT_EQ(pose.rejected, 1);
  EXPECT_NEAR(pose.bridged_s, 0.03, 1e-12);
  // One that is cut by the ends of intervals is one all the same.
  std::int64_t rejected = 0;
  PreintegratedPose part;
  for (std::int64_t k = 0; k < 200; ++k) {
    preintegrator.integrate(samples, k * kSecond / 200, (k + 1) * kSecond / 200, part);
    rejected += part.rejected;
  }
  EXPECT_EQ(rejected, 1);
}

TEST(Preintegration, CountsSamplesThatAreNotFinite) {
  const auto model = load_model(swerve("four_wis_wid"));
  auto samples = sample_motion(*model, wavy, 1., 100.);
  samples[50].drive_rad_per_s[0] = std::nan("");
  samples[60].steer_rad[3] = HUGE_VAL;
  Preintegrator preintegrator(model, {});
  PreintegratedPose pose;
  ASSERT_TRUE(preintegrator.integrate(samples, 0, kSecond, pose));
  EXPECT_EQ(pose.rejected, 2);
  EXPECT_TRUE(pose.g.allFinite());
  EXPECT_TRUE(pose.P_g.allFinite());
  EXPECT_TRUE(pose.parity.Lambda.allFinite());
}

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
  EXPECT_TRUE(preintegrator.integrate(samples, 0, 10 * kSecond, pose));
  return pose;
}

TEST(Preintegration, OfABaseAtRestTeachesNothingAboutItsWheels) {
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

TEST(Preintegration, ExpectsOfTheNoiseOfTheTwistsWhatItAddsToTheInformation) {
  const auto model = load_model(swerve("four_wis_wid"));
  const PreintegratedPose straight = with_noise_of({0.5, 0., 0.}, 5.);
  const PreintegratedPose turning = with_noise_of({0.4, -0.2, 0.6}, 5.);
  for (int k = 0; k < model->n_intrinsics(); ++k) {
    const std::string& name = model->description().intrinsics[static_cast<std::size_t>(k)].name;
    const double Lambda = straight.parity.Lambda(k, k);
    if (name[0] == 'x' || name[0] == 'y') {
      // Nothing turns: all of it is noise, the square of one normal number in each of 1000 samples.
      EXPECT_NEAR(straight.parity.of_noise(k, k) / Lambda, 1., 3. * std::sqrt(2. / 1000.)) << name;
    } else {
      EXPECT_LT(straight.parity.of_noise(k, k), 1e-2 * Lambda) << name;
    }
    EXPECT_LT(turning.parity.of_noise(k, k), 1e-3 * turning.parity.Lambda(k, k)) << name;
  }
  EXPECT_TRUE(with_noise_of(Twist::Zero(), 5.).parity.of_noise.isZero());
}

TEST(Preintegration, TakesAMotionThatOnlyTheMeanOfTheSamplesShowsForMotion) {
  const PreintegratedPose parked = with_noise_of(Twist::Zero(), 5.);
  const double sigma = std::sqrt(parked.P_g(0, 0) / 10. / 0.01);  // rad/s, of a sample
  const Twist creeping(0., 0., sigma);                            // a thousand samples show it
  EXPECT_GT(with_noise_of(creeping, 5.).parity.Lambda.trace(), 0.);
}

TEST(Preintegration, OfAGeneralMotionIsTheSameWithAndWithoutALimitOnMotion) {
  const Twist xi(0.4, -0.2, 0.6);
  const PreintegratedPose a = with_noise_of(xi, 5.), b = with_noise_of(xi, 0.);
  EXPECT_EQ(a.J_g_WI, b.J_g_WI);
  EXPECT_EQ(a.parity.Lambda, b.parity.Lambda);
  EXPECT_EQ(a.parity.eta, b.parity.eta);
}

}  // namespace
}  // namespace viwo
