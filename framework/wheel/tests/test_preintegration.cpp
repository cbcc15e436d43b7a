// Preintegrated pose, Jacobian and covariance against closed forms, fine numerical integration,
// central differences and sampling.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "viwo/math/chi2.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/testing/jacobian.hpp"
#include "viwo/wheel/preintegration.hpp"
#include "wavy_motion.hpp"
#include "wheel_fixture.hpp"

namespace viwo {
namespace {

using testing::central_difference;
using testing::differential;
using testing::jacobian_mismatch;
using testing::load_model;
using testing::sample_motion;
using testing::swerve;

/// theta' = omega, p' = R(theta) v by Runge-Kutta: the definition of g, independent of the arcs.
Eigen::Vector3d integrate_finely(const std::function<Twist(double)>& twist, double from,
                                 double to) {
  const int steps = 20000;
  const double h = (to - from) / steps;
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  const auto rate = [&](double t, const Eigen::Vector3d& at) {
    const Twist xi = twist(t);
    return Eigen::Vector3d(xi[2], std::cos(at[0]) * xi[0] - std::sin(at[0]) * xi[1],
                           std::sin(at[0]) * xi[0] + std::cos(at[0]) * xi[1]);
  };
  for (int i = 0; i < steps; ++i) {
    const double t = from + i * h;
    const Eigen::Vector3d k1 = rate(t, g), k2 = rate(t + h / 2, g + h / 2 * k1),
                          k3 = rate(t + h / 2, g + h / 2 * k2), k4 = rate(t + h, g + h * k3);
    g += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return g;
}

TEST(Preintegration, IsExactForConstantTwistAtAnyYawRate) {
  const auto model = load_model(swerve("four_wis_wid"));
  for (const double omega : {0., 1e-12, 1e-7, -1e-4, 0.02, -0.6, 3., 2. * M_PI}) {
    const Twist xi(0.4, -0.2, omega);
    // One sample of a whole second: the step itself, not a sum of small ones.
    const auto samples = sample_motion(
        *model, [&](double) { return xi; }, 2., 1.);
    Preintegrator preintegrator(model, {});
    PreintegratedPose pose;
    ASSERT_TRUE(preintegrator.integrate(samples, 0, 2 * kSecond, pose));
    const double theta = omega * 2.;
    // Closed form of the arc: p = (1/omega) [sin, cos-1; 1-cos, sin] v, its limit t v at omega = 0.
    Eigen::Vector2d p = 2. * xi.head<2>();
    if (std::abs(omega) > 1e-3) {
      Eigen::Matrix2d V;
      V << std::sin(theta), std::cos(theta) - 1., 1. - std::cos(theta), std::sin(theta);
      p = V * xi.head<2>() / omega;
    } else {
      p += J2() * xi.head<2>() * theta;  // second order of the same, exact to 1e-8 here
    }
    EXPECT_NEAR(pose.g[0], theta, 1e-12) << omega;
    EXPECT_LT((pose.g.tail<2>() - p).norm(), 3e-8) << omega;
  }
}

TEST(Preintegration, AgreesInEverySignWithAFineIntegrationOfTheTwist) {
  for (const auto& yaml : {swerve("four_wis_wid"), swerve("four_wis_wid_drive_only")}) {
    const auto model = load_model(yaml);
    const auto samples = sample_motion(*model, wavy, 4., 1000.);
    Preintegrator preintegrator(model, {});
    PreintegratedPose pose;
    // Ends that cut samples.
    ASSERT_TRUE(preintegrator.integrate(samples, 123'456'789, 3'456'789'012, pose));
    const Eigen::Vector3d g = integrate_finely(wavy, 0.123456789, 3.456789012);
    EXPECT_LT((pose.g - g).norm(), 2e-7) << pose.g.transpose() << " and " << g.transpose();
    EXPECT_GT(std::abs(g[0]), 0.5);
  }
}

TEST(Preintegration, ConvergesWithTheSquareOfTheSamplePeriodAlsoAtCutEnds) {
  const auto model = load_model(swerve("four_wis_wid"));
  const Eigen::Vector3d g = integrate_finely(wavy, 0.2131, 1.0777);
  std::vector<double> errors;
  for (const double rate : {25., 50., 100., 200.}) {
    const auto samples = sample_motion(*model, wavy, 2., rate);
    Preintegrator preintegrator(model, {});
    PreintegratedPose pose;
    ASSERT_TRUE(preintegrator.integrate(samples, 213'100'000, 1'077'700'000, pose));
    errors.push_back((pose.g - g).norm());
  }
  EXPECT_LT(errors.back(), 2e-5);
  EXPECT_GT(errors.front() / errors.back(), 64. / 2.5) << "second order: a factor of 64 for 8";
}

TEST(Preintegration, HasTheJacobianOfCentralDifferences) {
  for (const auto& yaml :
       {swerve("four_wis_wid"), swerve("four_wis_wid", ", prior_sigma_steer_gain: 0.02"),
        swerve("four_wis_wid_drive_only"),
        swerve("four_wis_wid_drive_only", ", prior_sigma_steer_gain: 0.02"), differential()}) {
    const auto model = load_model(yaml);
    const bool can_crab = model->description().n_steer > 0;
    const std::function<Twist(double)> motions[] = {
        [](double) { return Twist(0., 0., 0.); }, [](double) { return Twist(0.5, 0., 0.); },
        [](double) { return Twist(0., 0., 0.9); }, [](double) { return Twist(-0.3, 0., -0.7); },
        [&](double t) { return can_crab ? wavy(t) : Twist(0.3, 0., std::sin(t)); }};
    for (const auto& motion : motions) {
      std::mt19937_64 rng(3);
      auto samples = sample_motion(*model, motion, 1., 50.);
      for (EncoderSample& sample : samples) {
        sample = testing::with_noise(*model, motion(1e-9 * static_cast<double>(sample.t_ns)),
                                     sample, 5., rng);
      }
      Preintegrator preintegrator(model, {.twist = {.rank_tolerance = 1e-9}});
      PreintegratedPose pose;
      const auto g_of = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
        preintegrator.move_intrinsics(x);
        preintegrator.integrate(samples, 33'000'000, 977'000'000, pose);
        return pose.g;
      };
      const Eigen::MatrixXd numeric = central_difference(g_of, model->nominal(), 1e-6);
      preintegrator.set_intrinsics(model->nominal());
      preintegrator.integrate(samples, 33'000'000, 977'000'000, pose);
      std::vector<std::string> names;
      for (const auto& spec : model->description().intrinsics) names.push_back(spec.name);
      EXPECT_EQ(jacobian_mismatch(pose.J_g_WI, numeric, names, 2e-5), "") << yaml;
    }
  }
}

/// Motion for sampling tests: every model can follow it, rolling rows stay independent, and no
/// wheel comes near the centre of rotation, where slip would not be small against its speed.
Twist sampling_motion(const WheelModel& model, double t) {
  if (model.description().n_steer == 0) return {0.4, 0., std::sin(t)};
  return {0.03 * std::cos(0.9 * t), 0.03 * std::sin(1.3 * t), 0.9 + 0.3 * std::sin(0.8 * t)};
}

/// Mean normalised squared error of `runs` noisy integrations against the noise-free one; noise in
/// the samples `noise_scale` times what the model says.
double mean_nees(const std::string& yaml, bool weighted, double noise_scale, std::int64_t begin_ns,
                 std::int64_t end_ns, int runs) {
  const auto model = load_model(yaml);
  const auto clean = sample_motion(
      *model, [&](double t) { return sampling_motion(*model, t); }, 1., 100.);
  Preintegrator preintegrator(
      model, {.twist = {.noise_weighted = weighted, .rank_tolerance = 1e-6}, .parity = false});
  PreintegratedPose truth, pose;
  EXPECT_TRUE(preintegrator.integrate(clean, begin_ns, end_ns, truth));
  std::mt19937_64 rng(20261121);
  double sum = 0.;
  for (int run = 0; run < runs; ++run) {
    auto noisy = clean;
    Eigen::Vector3d true_g = Eigen::Vector3d::Zero();
    for (EncoderSample& sample : noisy) {
      Twist xi = sampling_motion(*model, 1e-9 * static_cast<double>(sample.t_ns));
      RowVector slip;
      sample = testing::with_noise(*model, xi, sample, noise_scale, rng, &slip);
      // Encoders of a differential drive do not see its axle slide: there the truth moves.
      if (model->description().n_steer == 0) xi[1] -= slip[model->n_rows() - 1];
      const double dt = seconds_between(sample.begin_ns, sample.end_ns);
      Eigen::Vector3d arc;
      arc << xi[2] * dt, dt * sinc(0.5 * xi[2] * dt).value * R2(0.5 * xi[2] * dt) * xi.head<2>();
      true_g = compose(true_g, arc);
    }
    preintegrator.integrate(noisy, begin_ns, end_ns, pose);
    const Eigen::Vector3d error = pose.g - (model->description().n_steer == 0 ? true_g : truth.g);
    sum += error.dot(pose.P_g.ldlt().solve(error));
  }
  return sum / runs;
}

struct Bounds {
  double low, high;
};

/// Two-sided 99.9 % bounds of the mean of `runs` chi-square variables with 3 degrees of freedom.
Bounds bounds(int runs) {
  return {chi2_quantile(0.0005, 3. * runs) / runs, chi2_quantile(0.9995, 3. * runs) / runs};
}

// Small noise: the covariance is of first order, and lateral slip n of a wheel that rolls with v
// shortens what it rolls by n^2/v, a bias that at the default sizes is not small against the drive
// noise.
const std::string kSmallNoise = ", sigma_drive_rad_per_s: 1.0e-5, sigma_lateral_m_per_s: 1.0e-5";
const std::string kSmallSwerveNoise = kSmallNoise + ", sigma_steer_rad: 1.0e-5";

TEST(Preintegration, HasTheCovarianceOfManyNoisyRuns) {
  const int runs = 2000;
  const Bounds limit = bounds(runs);
  EXPECT_GT(limit.low, 2.8);
  EXPECT_LT(limit.high, 3.2);
  for (const auto& yaml :
       {swerve("four_wis_wid", kSmallSwerveNoise),
        swerve("four_wis_wid_drive_only", kSmallSwerveNoise), differential(kSmallNoise)}) {
    for (const bool weighted : {false, true}) {
      const double whole = mean_nees(yaml, weighted, 1., 0, kSecond, runs);
      EXPECT_GT(whole, limit.low) << yaml << weighted;
      EXPECT_LT(whole, limit.high) << yaml << weighted;
    }
  }
}

TEST(Preintegration, HasTheCovarianceOfManyNoisyRunsWhereCutSamplesDominate) {
  // Three pieces, two of them with a part of the sample before: without the correlation of
  // neighbours the covariance would be wrong by a third. Two, of which one borrows from the other.
  const int runs = 4000;
  const Bounds limit = bounds(runs);
  for (const std::int64_t end_ns : {523'000'000, 514'000'000}) {
    const double nees =
        mean_nees(swerve("four_wis_wid", kSmallSwerveNoise), false, 1., 506'000'000, end_ns, runs);
    EXPECT_GT(nees, limit.low) << end_ns;
    EXPECT_LT(nees, limit.high) << end_ns;
  }
}

TEST(Preintegration, FailsTheSameTestWithTwiceOrHalfTheStatedNoise) {
  const int runs = 200;
  const Bounds limit = bounds(runs);
  EXPECT_GT(mean_nees(swerve("four_wis_wid", kSmallSwerveNoise), false, 2., 0, kSecond, runs),
            limit.high);
  EXPECT_LT(mean_nees(swerve("four_wis_wid", kSmallSwerveNoise), false, 0.5, 0, kSecond, runs),
            limit.low);
}

TEST(Preintegration, ComposesPartsToTheWhole) {
  const auto model = load_model(swerve("four_wis_wid"));
  std::mt19937_64 rng(5);
  auto samples = sample_motion(*model, wavy, 2., 100.);
  for (auto& sample : samples) {
    sample =
        testing::with_noise(*model, wavy(1e-9 * static_cast<double>(sample.t_ns)), sample, 1., rng);
  }
  Preintegrator preintegrator(model, {});
  PreintegratedPose whole, total, part;
  ASSERT_TRUE(preintegrator.integrate(samples, 0, 2 * kSecond, whole));
  total.reset(16);
  for (int k = 0; k < 20; ++k) {  // cuts on the boundaries of cells: nothing is interpolated
    ASSERT_TRUE(preintegrator.integrate(samples, k * kSecond / 10, (k + 1) * kSecond / 10, part));
    append(total, part);
  }
  EXPECT_LT((total.g - whole.g).norm(), 1e-12);
  EXPECT_LT((total.J_g_WI - whole.J_g_WI).norm(), 1e-10);
  EXPECT_LT((total.P_g - whole.P_g).norm(), 1e-10 * whole.P_g.norm());
  EXPECT_LT((total.parity.Lambda - whole.parity.Lambda).norm(), 1e-9 * whole.parity.Lambda.norm());
  EXPECT_EQ(total.samples, whole.samples);
}

TEST(Preintegration, UsesTheParityOfACutSampleOnceOverBothIntervals) {
  const auto model = load_model(swerve("four_wis_wid"));
  const auto samples = sample_motion(
      *model, [](double) { return Twist(0.3, 0.1, 0.4); }, 1., 10.);
  Preintegrator preintegrator(model, {});
  PreintegratedPose whole, total, part;
  ASSERT_TRUE(preintegrator.integrate(samples, 0, kSecond, whole));
  total.reset(16);
  for (const auto& [from, to] :
       {std::pair{0, 437'000'000}, std::pair{437'000'000, 1'000'000'000}}) {
    ASSERT_TRUE(preintegrator.integrate(samples, from, to, part));
    append(total, part);
  }
  EXPECT_LT((total.parity.Lambda - whole.parity.Lambda).norm(), 1e-9 * whole.parity.Lambda.norm());
}

/// What four wheels that go straight on have counted, all of them alike.
EncoderSample counted_straight(std::int64_t begin_ns, std::int64_t end_ns, double angle_rad) {
  EncoderSample sample;
  sample.n_drive = sample.n_steer = 4;
  sample.begin_ns = begin_ns;
  sample.end_ns = sample.t_ns = end_ns;
  for (std::size_t i = 0; i < 4; ++i) {
    sample.drive_rad_per_s[i] = angle_rad / seconds_between(begin_ns, end_ns);
  }
  return sample;
}

TEST(Preintegration, GivesWhatWasCountedHoweverIntervalsCutAndStampsJitter) {
  const auto model = load_model(swerve("four_wis_wid"));
  // Counts of a straight way at a speed that changes, with stamps up to half a period off.
  const double radius_m = 0.1, rate_hz = 50.;
  const auto angle_rad = [&](double t) { return (0.8 * t + 0.3 * std::sin(1.1 * t)) / radius_m; };
  std::mt19937_64 rng(3);
  std::uniform_int_distribution<std::int64_t> jitter_ns(-9'900'000, 9'900'000);
  std::vector<EncoderSample> samples;
  std::int64_t begin_ns = 0;
  for (int k = 1; k <= 500; ++k) {
    const std::int64_t end_ns = k * (kSecond / 50) + jitter_ns(rng);
    const double counted = angle_rad(k / rate_hz) - angle_rad((k - 1) / rate_hz);
    samples.push_back(counted_straight(begin_ns, end_ns, counted));
    begin_ns = end_ns;
  }
  Preintegrator preintegrator(model, {});
  PreintegratedPose whole, total, part;
  ASSERT_TRUE(preintegrator.integrate(samples, 0, begin_ns, whole));
  EXPECT_GT(whole.g[1], 1.);
  for (const std::int64_t epoch_ns : {7'000'000, 20'000'000, 50'000'000, 333'000'000}) {
    total.reset(16);
    for (std::int64_t from_ns = 0; from_ns < begin_ns; from_ns += epoch_ns) {
      // No sample is known but those that reach over the interval, as while driving.
      const std::int64_t to_ns = std::min(from_ns + epoch_ns, begin_ns);
      const auto known = std::find_if(samples.begin(), samples.end(),
                                      [&](const auto& sample) { return sample.end_ns >= to_ns; });
      const auto n = static_cast<std::size_t>(known - samples.begin()) + 1;
      ASSERT_TRUE(preintegrator.integrate({samples.data(), n}, from_ns, to_ns, part));
      append(total, part);
    }
    EXPECT_NEAR(total.g[1], whole.g[1], 1e-12) << epoch_ns;
  }
}

TEST(Preintegration, TakesNoSlopeFromACellOfStampsThatCameInABunch) {
  const auto model = load_model(swerve("four_wis_wid"));
  // 0.04 m/s by counts over 50 ms, which arrive two at a time, two microseconds apart.
  const double radius_m = 0.0255;
  std::vector<EncoderSample> samples;
  std::int64_t begin_ns = 0;
  for (int k = 1; k <= 40; ++k) {
    const std::int64_t end_ns = k / 2 * (kSecond / 10) + (k % 2 == 0 ? 0 : 2'000);
    samples.push_back(counted_straight(begin_ns, end_ns, 0.002 / radius_m));
    begin_ns = end_ns;
  }
  Preintegrator preintegrator(model, {});
  PreintegratedPose pose;
  for (std::int64_t to_ns = 330'000'000; to_ns < begin_ns; to_ns += 30'000'000) {
    ASSERT_TRUE(preintegrator.integrate(samples, 0, to_ns, pose));
    EXPECT_NEAR(pose.g[1], 0.04e-9 * static_cast<double>(to_ns), 0.0045) << to_ns;  // of a bunch
  }
}

TEST(Preintegration, IsTheSameWhereSteeringReadingsBeginAnew) {
  for (const auto& yaml : {swerve("four_wis_wid"), swerve("four_wis_wid_drive_only")}) {
    const auto model = load_model(yaml);
    // Crabs round and round: all wheels pass the end of the circle, at another time each.
    auto samples = sample_motion(
        *model, [](double t) { return Twist(0.5 * std::cos(2. * t), 0.5 * std::sin(2. * t), 0.1); },
        8., 50.);
    auto wrapped = samples;
    for (EncoderSample& sample : wrapped) {
      for (double& angle : sample.steer_rad) angle = std::remainder(angle, 2. * M_PI);
    }
    EXPECT_GT(samples.back().steer_rad[0], 2. * M_PI);
    Preintegrator preintegrator(model, {});
    PreintegratedPose pose, of_wrapped;
    for (std::int64_t from = 3'000'000; from < 7 * kSecond; from += 33'000'000) {
      ASSERT_TRUE(preintegrator.integrate(samples, from, from + 33'000'000, pose));
      ASSERT_TRUE(preintegrator.integrate(wrapped, from, from + 33'000'000, of_wrapped));
      EXPECT_LT((pose.g - of_wrapped.g).norm(), 1e-13) << from;
      EXPECT_LT((pose.P_g - of_wrapped.P_g).norm(), 1e-13) << from;
    }
  }
}

}  // namespace
}  // namespace viwo
