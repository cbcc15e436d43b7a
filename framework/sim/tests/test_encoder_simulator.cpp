// Simulated encoders: rows satisfied, noise as described, streams apart, faults where asked.
#include <array>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "message_of.hpp"
#include "two_wheels.hpp"
#include "viwo/api/status.hpp"
#include "viwo/sim/encoder_simulator.hpp"

namespace viwo::sim {
namespace {

constexpr double kPi = std::numbers::pi;

ModelDescription description_of(const KinematicModel& model) {
  ModelDescription description;
  model.describe(description);
  return description;
}

EncoderSimulation silent(double duration_s = 30.) {
  EncoderSimulation options;
  options.duration_s = duration_s;
  options.noise = false;
  return options;
}

/// b - A xi at a sample.
Eigen::Vector4d row_residual(const KinematicModel& model, const Intrinsics& x, const Twist& xi,
                             const EncoderSample& sample) {
  RowSystem rows;
  rows.A.setZero(4, 3);
  rows.b.setZero(4);
  EXPECT_EQ(model.rows(sample, x, false, rows), Status::kOk);
  return rows.b - rows.A * xi;
}

class EachInverse : public ::testing::TestWithParam<bool> {
 protected:
  EachInverse() { model_.own_inverse = GetParam(); }
  TwoWheels model_;
};

INSTANTIATE_TEST_SUITE_P(OwnAndGeneric, EachInverse, ::testing::Values(true, false),
                         [](const auto& which) { return which.param ? "Own" : "Generic"; });

TEST_P(EachInverse, RowsAreSatisfiedWithoutNoiseForEveryMotion) {
  const Intrinsics x = perturbed_intrinsics(description_of(model_), 1., 9);
  for (const std::string& name : PlanarMotion::names()) {
    const PlanarMotion motion(name);
    EncoderSimulation options = silent(20.);
    options.time_offset_s = 0.013;
    for (const EncoderSample& sample : simulate_encoders(model_, x, motion, options, 1)) {
      const double t = static_cast<double>(sample.t_ns) * 1e-9 + 0.013;
      const double worst =
          row_residual(model_, x, motion.twist(t), sample).lpNorm<Eigen::Infinity>();
      ASSERT_LE(worst, 1e-12) << name << " at " << t;
    }
  }
}

TEST_P(EachInverse, StraightAndLateralReadTheirClosedForms) {
  const Intrinsics x = nominal_intrinsics(description_of(model_));
  for (const auto& [name, angle] : {std::pair{"straight", 0.}, std::pair{"lateral", kPi / 2.}}) {
    const auto samples = simulate_encoders(model_, x, PlanarMotion(name), silent(), 1);
    ASSERT_EQ(samples.size(), 3001U);
    const EncoderSample& last = samples.back();
    for (std::size_t i = 0; i < 2; ++i) {
      // Rolling backwards at the opposite steering angle is the same motion.
      const double sign = last.drive_rad_per_s[i] < 0. ? -1. : 1.;
      const double delta = angle + (sign < 0. ? kPi : 0.);
      EXPECT_NEAR(sign * last.drive_rad_per_s[i], 0.5 / x[static_cast<int>(i)], 1e-10) << name;
      EXPECT_NEAR(std::remainder(last.steer_rad[i] - x[2 + static_cast<int>(i)] - delta, 2. * kPi),
                  0., 1e-11)
          << name;
    }
    // From the first sample on the wheels stand in the direction of the motion.
    EXPECT_NEAR(samples.front().steer_rad[0], last.steer_rad[0], 1e-9) << name;
  }
}

TEST_P(EachInverse, WithNoiseTheRowsResidualsHaveTheDescribedDeviations) {
  const Intrinsics x = nominal_intrinsics(description_of(model_));
  MotionOptions fast;
  fast.ramp_s = 0.;
  const PlanarMotion motion("straight", fast);
  EncoderSimulation options;
  options.duration_s = 100.;
  const auto samples = simulate_encoders(model_, x, motion, options, 4);
  const double n = static_cast<double>(samples.size());
  Eigen::Vector4d sum = Eigen::Vector4d::Zero(), sum2 = sum, lag = sum, last = sum;
  for (const EncoderSample& sample : samples) {
    const Eigen::Vector4d r = row_residual(model_, x, motion.twist(1.), sample);
    sum += r;
    sum2 += r.cwiseAbs2();
    lag += r.cwiseProduct(last);
    last = r;
  }
  for (int j = 0; j < 2; ++j) {
    const double longitudinal = x[j] * model_.sigma_drive;
    const double lateral = std::hypot(0.5 * model_.sigma_steer, model_.sigma_slip);
    for (const auto& [row, sigma] :
         {std::pair{2 * j, longitudinal}, std::pair{2 * j + 1, lateral}}) {
      // Two-sided, four standard deviations of each statistic; the second-order effect of the
      // steering noise on the rolling direction, v sigma^2 / 2, is below 3e-6 m/s.
      EXPECT_NEAR(sum[row] / n, 0., 4. * sigma / std::sqrt(n) + 3e-6) << row;
      EXPECT_NEAR(sum2[row] / n / (sigma * sigma), 1., 4. * std::sqrt(2. / n)) << row;
      EXPECT_NEAR(lag[row] / n / (sigma * sigma), 0., 4. / std::sqrt(n)) << row;
    }
  }
}

TEST_P(EachInverse, ABaseAtRestDoesNotSlip) {
  const Intrinsics x = nominal_intrinsics(description_of(model_));
  for (const EncoderSample& sample :
       simulate_encoders(model_, x, PlanarMotion("stationary"), {}, 3)) {
    for (std::size_t i = 0; i < 2; ++i) {
      ASSERT_LT(std::abs(sample.drive_rad_per_s[i]), 6. * model_.sigma_drive);
      ASSERT_LT(std::abs(std::remainder(sample.steer_rad[i], kPi)), 6. * model_.sigma_steer);
    }
  }
}

std::vector<EncoderSample> circle(const TwoWheels& model, const EncoderSimulation& options,
                                  std::uint64_t seed = 7) {
  return simulate_encoders(model, nominal_intrinsics(description_of(model)), PlanarMotion("circle"),
                           options, seed);
}

TEST(EncoderSimulator, SameSeedGivesTheSameBitsAndAnotherSeedDoesNot) {
  const TwoWheels model;
  const auto a = circle(model, {}), b = circle(model, {}), c = circle(model, {}, 8);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].drive_rad_per_s, b[k].drive_rad_per_s);
    EXPECT_EQ(a[k].steer_rad, b[k].steer_rad);
    EXPECT_NE(a[k].drive_rad_per_s, c[k].drive_rad_per_s);
  }
}

TEST(EncoderSimulator, ChangingOneDisturbanceLeavesTheOthersAsTheyWere) {
  TwoWheels model;
  model.own_inverse = true;
  const auto plain = circle(model, {});
  EncoderSimulation with_outliers;
  with_outliers.outlier_probability = 0.1;
  with_outliers.outlier_rad_per_s = 3.;
  const auto outliers = circle(model, with_outliers);
  TwoWheels louder = model;
  louder.sigma_drive *= 2.;
  const auto loud = circle(louder, {});
  TwoWheels without_slip = model;
  without_slip.sigma_slip = 0.;
  TwoWheels almost_without_slip = model;
  almost_without_slip.sigma_slip = 1e-13;
  const auto none = circle(without_slip, {}), almost = circle(almost_without_slip, {});
  int hits = 0;
  for (std::size_t k = 0; k < plain.size(); ++k) {
    EXPECT_EQ(outliers[k].steer_rad, plain[k].steer_rad);
    EXPECT_EQ(loud[k].steer_rad, plain[k].steer_rad);
    const Eigen::Array2d off(outliers[k].drive_rad_per_s[0] - plain[k].drive_rad_per_s[0],
                             outliers[k].drive_rad_per_s[1] - plain[k].drive_rad_per_s[1]);
    if ((off != 0.).any()) {
      ++hits;
      EXPECT_NEAR(off.abs().maxCoeff(), 3., 1e-12);
      EXPECT_EQ(off.abs().minCoeff(), 0.);
    }
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_NEAR(almost[k].drive_rad_per_s[i], none[k].drive_rad_per_s[i], 1e-9);
      EXPECT_NEAR(almost[k].steer_rad[i], none[k].steer_rad[i], 1e-6);  // slip at the slow start
    }
  }
  const double n = static_cast<double>(plain.size());
  EXPECT_NEAR(hits, 0.1 * n, 4. * std::sqrt(0.09 * n));
}

TEST(EncoderSimulator, StampsAreInTheWheelClockAndCellsMeet) {
  EncoderSimulation options = silent(1.);
  options.rate_hz = 30.;
  options.start_ns = 1'000;
  options.time_offset_s = 0.25;
  const TwoWheels model;
  const auto samples = circle(model, options);
  ASSERT_EQ(samples.size(), 31U);
  EXPECT_EQ(samples[0].t_ns, 1'000);
  EXPECT_EQ(samples[0].begin_ns, 1'000);
  EXPECT_EQ(samples[1].t_ns, 33'334'333);
  EXPECT_EQ(samples[0].end_ns, 16'667'666);
  EXPECT_EQ(samples[1].begin_ns, 16'667'666);
  EXPECT_EQ(samples[30].t_ns, 1'000'001'000);
  EXPECT_EQ(samples[30].end_ns, 1'000'001'000);
  const Twist xi = PlanarMotion("circle").twist(0.25);
  const Intrinsics x = nominal_intrinsics(description_of(model));
  EXPECT_LE(row_residual(model, x, xi, samples[0]).lpNorm<Eigen::Infinity>(), 1e-12);
}

TEST(EncoderSimulator, ASpinningWheelReadsMoreInItsWindowsOnly) {
  EncoderSimulation options = silent(5.);
  const TwoWheels model;
  const auto plain = circle(model, options);
  options.slip = {{1., 3.}, 0.5, 1, 0.2};
  const auto slipping = circle(model, options);
  for (std::size_t k = 0; k < plain.size(); ++k) {
    const bool inside = (k >= 100 && k < 150) || (k >= 300 && k < 350);
    EXPECT_EQ(slipping[k].drive_rad_per_s[0], plain[k].drive_rad_per_s[0]);
    EXPECT_NEAR(slipping[k].drive_rad_per_s[1], plain[k].drive_rad_per_s[1] * (inside ? 1.2 : 1.),
                1e-12);
  }
  options.slip.wheel = 2;
  EXPECT_THROW(circle(model, options), std::invalid_argument);
}

TEST(EncoderSimulator, RoundsRatesToTheResolution) {
  EncoderSimulation options = silent(5.);
  const TwoWheels model;
  const auto plain = circle(model, options);
  options.drive_resolution_rad_per_s = 0.25;
  const auto rounded = circle(model, options);
  for (std::size_t k = 0; k < plain.size(); ++k) {
    const double ratio = rounded[k].drive_rad_per_s[0] / 0.25;
    EXPECT_EQ(ratio, std::round(ratio));
    EXPECT_LE(std::abs(rounded[k].drive_rad_per_s[0] - plain[k].drive_rad_per_s[0]), 0.125);
  }
}

TEST(EncoderSimulator, SaysWhichMotionABaseCannotFollow) {
  TwoWheels model;
  model.own_inverse = true;
  model.can_crab = false;
  MotionOptions fast;
  fast.ramp_s = 0.;
  EXPECT_EQ(testing::error_of([&] {
              simulate_encoders(model, nominal_intrinsics(description_of(model)),
                                PlanarMotion("lateral", fast), silent(), 1);
            }),
            "this base cannot follow motion 'lateral' (v = [0, 0.5] m/s, omega = 0 rad/s after "
            "0 s)");
}

/// Mean and mean square, in prior sigmas.
std::array<Eigen::Vector4d, 2> moments_of(const ModelDescription& description, int n) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero(), sum2 = sum;
  for (int seed = 0; seed < n; ++seed) {
    const Intrinsics x = perturbed_intrinsics(description, 2., static_cast<std::uint64_t>(seed));
    for (int i = 0; i < 4; ++i) {
      const IntrinsicSpec& spec = description.intrinsics[static_cast<std::size_t>(i)];
      const double e = (x[i] - spec.nominal) / (2. * spec.prior_sigma);
      sum[i] += e / n;
      sum2[i] += e * e / n;
    }
  }
  return {sum, sum2};
}

TEST(PerturbedIntrinsics, AreDrawnWithThePriorSigmaAroundTheNominalValues) {
  ModelDescription description = description_of(TwoWheels());
  const int n = 20'000;
  const auto is_drawn = [&](int i) {
    const auto [mean, square] = moments_of(description, n);
    EXPECT_NEAR(mean[i], 0., 4. / std::sqrt(n)) << i;
    EXPECT_NEAR(square[i], 1., 4. * std::sqrt(2. / n)) << i;
  };
  for (const int i : {0, 1, 3}) is_drawn(i);
  EXPECT_EQ(moments_of(description, n)[1][2], 0.);  // held alone: it is where the base turns
  EXPECT_EQ(perturbed_intrinsics(description, 0., 5), nominal_intrinsics(description));
  // Three place all of O, and a robot knows nothing of that.
  for (const std::size_t i : {0u, 1u, 2u}) description.intrinsics[i].gauge_fixed = true;
  for (const int i : {0, 1, 2, 3}) is_drawn(i);
}

TEST(SolveInverse, LeavesTheSampleAloneWhereThereIsNoSolution) {
  TwoWheels model;
  const ModelDescription description = description_of(model);
  RowVector slip = RowVector::Zero(4);
  slip[1] = 1.;  // 1 m/s sideways cannot be had from 0.5 m/s
  EncoderSample y;
  y.n_drive = y.n_steer = 2;
  y.drive_rad_per_s[0] = 3.;
  EXPECT_EQ(
      solve_inverse(model, description, {0.5, 0., 0.}, nominal_intrinsics(description), slip, y),
      Status::kRejected);
  EXPECT_EQ(y.drive_rad_per_s[0], 3.);
}

TEST(WanderSigmas, AreOfThoseThatAreNamed) {
  const ModelDescription description = description_of(TwoWheels());
  EXPECT_EQ(wander_sigmas(description, 0.5, {}), Eigen::Vector4d(0.0005, 0.001, 0.005, 0.01));
  EXPECT_EQ(wander_sigmas(description, 0.5, {"r_2", "o"}), Eigen::Vector4d(0., 0.001, 0.005, 0.01));
  try {
    wander_sigmas(description, 0.5, {"o", "radius"});
    FAIL() << "'radius' was taken";
  } catch (const ParamError& error) {
    EXPECT_EQ(error.key(), "intrinsics_wander_of");
    EXPECT_STREQ(error.what(),
                 "no intrinsic of the model begins with 'radius' - there are r_1, r_2, o_1, o_2");
  }
}

}  // namespace
}  // namespace viwo::sim
