// How large each noise of the wheels is: variance components of the parity residual.
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "viwo/math/chi2.hpp"
#include "viwo/wheel/wheel_noise.hpp"
#include "wheel_fixture.hpp"

namespace viwo {
namespace {

using testing::load_model;
using testing::sample_motion;

/// Speeds and directions change, so that noise of steering and slip differ.
Twist wavering(double t) {
  return {0.6 + 0.5 * std::cos(0.9 * t), 0.2 * std::sin(1.3 * t), 0.5 * std::sin(0.8 * t)};
}

const std::string kNoisySwerve =
    testing::swerve("four_wis_wid",
                    ", sigma_drive_rad_per_s: 0.2, sigma_steer_rad: 0.01, "
                    "sigma_lateral_m_per_s: 0.003");

/// Factors on what is configured.
struct TrueNoise {
  double drive = 1., steer = 1., slip = 1.;
  int worse_drive = -1;  ///< one that is 2.5 times as noisy as the others

  double of(const NoiseSpec& noise) const {
    if (noise.kind == NoiseKind::kSteer) return steer;
    if (noise.kind == NoiseKind::kSlip) return slip;
    return noise.channel == worse_drive ? 2.5 * drive : drive;
  }
};

/// What the wheels read that move with `xi` and the noise of `truth`: each source enters the rows
/// as the model says that it does.
EncoderSample with_true_noise(const WheelModel& model, const Twist& xi, EncoderSample y,
                              const TrueNoise& truth, std::mt19937_64& rng) {
  std::normal_distribution<double> gauss;
  RowSystem rows;
  rows.A.setZero(model.n_rows(), 3);
  rows.b.setZero(model.n_rows());
  NoiseDerivatives by_n;
  by_n.J.setZero(model.n_rows(), model.n_noises());
  by_n.DtE.setZero(3, model.n_noises());
  RowVector slip = RowVector::Zero(model.n_rows());
  model.model().rows(y, model.nominal(), false, rows);
  model.model().noise_derivatives(y, model.nominal(), rows, rows.b, xi, slip, by_n);
  const std::vector<NoiseSpec>& noises = model.description().noises;
  for (std::size_t k = 0; k < noises.size(); ++k) {
    if (noises[k].kind != NoiseKind::kSlip) continue;
    slip += truth.of(noises[k]) * noises[k].sigma * gauss(rng) * by_n.J.col(static_cast<int>(k));
  }
  model.model().inverse(xi, model.nominal(), slip, y);
  for (const NoiseSpec& noise : noises) {
    const auto i = static_cast<std::size_t>(noise.channel);
    const double n = truth.of(noise) * noise.sigma * gauss(rng);
    if (noise.kind == NoiseKind::kDrive) y.drive_rad_per_s[i] += n;
    if (noise.kind == NoiseKind::kSteer) y.steer_rad[i] += n;
  }
  return y;
}

Twist ahead(double t) {
  const Twist xi = wavering(t);
  return {xi[0], 0., xi[2]};
}

/// As nearly every recording begins.
Twist wavering_after_a_rest(double t) { return t < 8. ? Twist::Zero() : wavering(t); }

/// A minute, at the true calibration but `off`, of which the prior knows `sigma`.
WheelNoise noise_after(const std::shared_ptr<const WheelModel>& shared, const TrueNoise& truth,
                       unsigned seed, double off = 0., double sigma = 0.,
                       Twist (*motion)(double) = wavering) {
  const WheelModel& model = *shared;
  WheelNoise noise(shared);
  const int n = model.n_intrinsics();
  IntrinsicMatrix P = IntrinsicMatrix::Zero(n, n);
  P.diagonal().setConstant(sigma * sigma);
  const Intrinsics x = model.nominal() + Intrinsics::Constant(n, off);
  std::mt19937_64 rng(seed);
  for (const EncoderSample& clean : sample_motion(model, motion, 60., 50.)) {
    const Twist xi = motion(1e-9 * static_cast<double>(clean.t_ns));
    noise.add(xi.isZero() ? clean : with_true_noise(model, xi, clean, truth, rng), x, P);
  }
  return noise;
}

class WheelNoiseOf : public ::testing::TestWithParam<TrueNoise> {};

/// Each kind, to what the information says that it can be known: the sum of 3 x kRuns squared
/// errors in units of their sigmas within the bounds of its chi-square distribution.
TEST_P(WheelNoiseOf, EachKindIsFoundToTheSigmaThatIsClaimed) {
  constexpr int kRuns = 12;
  const auto model = load_model(kNoisySwerve);
  double sum = 0., sum_as_configured = 0.;
  int known = 0;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    for (const WheelNoise::Part& part : noise_after(model, GetParam(), seed).parts()) {
      EXPECT_FALSE(part.alone) << part.noise->parameter << " " << part.noise->channel;
      const double truth = std::pow(GetParam().of(*part.noise), 2);
      sum += std::pow((part.variance - truth) / part.sigma, 2);
      sum_as_configured += std::pow((part.variance - 1.) / part.sigma, 2);
      ++known;
    }
  }
  ASSERT_GE(known, kRuns);
  const double low = chi2_quantile(1e-4, known), high = chi2_quantile(1. - 1e-4, known);
  EXPECT_GT(sum, low);
  EXPECT_LT(sum, high);
  // Not so against other noises than those that were there.
  const bool is_configured = GetParam().drive * GetParam().steer * GetParam().slip == 1. &&
                             GetParam().drive == GetParam().slip;
  EXPECT_EQ(sum_as_configured < high, is_configured);
}

INSTANTIATE_TEST_SUITE_P(Factors, WheelNoiseOf,
                         ::testing::Values(TrueNoise{}, TrueNoise{0.3, 1., 1.},
                                           TrueNoise{3., 1., 1.}, TrueNoise{1., 0.3, 1.},
                                           TrueNoise{1., 3., 1.}, TrueNoise{1., 1., 0.3},
                                           TrueNoise{1., 1., 3.}, TrueNoise{3., 0.3, 1.},
                                           TrueNoise{3., 3., 3.}, TrueNoise{0.3, 0.3, 0.3}));

TEST(WheelNoise, NamesTheDriveThatIsWorseThanTheOthers) {
  const auto model = load_model(kNoisySwerve);
  TrueNoise truth;
  truth.worse_drive = 2;
  const WheelNoise noise = noise_after(model, truth, 1);
  std::vector<WheelNoise::Part> alone;
  for (const WheelNoise::Part& part : noise.parts()) {
    if (part.alone) alone.push_back(part);
  }
  ASSERT_EQ(alone.size(), 1u);
  EXPECT_EQ(alone[0].noise->channel, 2);
  EXPECT_NEAR(alone[0].variance, 2.5 * 2.5, 4. * alone[0].sigma);
  std::vector<NoiseFound> out;
  noise.append_to(out);
  const auto named = std::find_if(out.begin(), out.end(), [](const NoiseFound& found) {
    return found.name == "sigma_drive_rad_per_s of drive 3";
  });
  ASSERT_NE(named, out.end());
  EXPECT_EQ(named->unit, "rad/s");
  EXPECT_EQ(named->configured, 0.2);
  EXPECT_NEAR(named->found, 0.2 * std::sqrt(alone[0].variance), 1e-12);
}

TEST(WheelNoise, PassesOverOutliers) {
  const auto model = load_model(kNoisySwerve);
  WheelNoise noise(model);
  const int n = model->n_intrinsics();
  const IntrinsicMatrix P = IntrinsicMatrix::Zero(n, n);
  std::mt19937_64 rng(5);
  int i = 0;
  for (const EncoderSample& clean : sample_motion(*model, wavering, 60., 50.)) {
    const Twist xi = wavering(1e-9 * static_cast<double>(clean.t_ns));
    EncoderSample y = with_true_noise(*model, xi, clean, {}, rng);
    if (++i % 20 == 0) y.drive_rad_per_s[1] += 20.;
    noise.add(y, model->nominal(), P);
  }
  for (const WheelNoise::Part& part : noise.parts()) {
    EXPECT_FALSE(part.alone);
    EXPECT_NEAR(part.variance, 1., 4. * part.sigma);
  }
}

TEST(WheelNoise, TellsNothingWhileTheCalibrationIsRough) {
  const auto model = load_model(kNoisySwerve);
  EXPECT_TRUE(noise_after(model, {}, 1, 1e-3, 0.05).parts().empty());
  EXPECT_FALSE(noise_after(model, {}, 1, 0., 1e-5).parts().empty());
}

/// A base that stands has readings without noise and wheels without slip: more of them than the
/// weights are renewed after.
TEST(WheelNoise, IsThatOfDriving) {
  const auto model = load_model(kNoisySwerve);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto parts = noise_after(model, {}, seed, 0., 0., wavering_after_a_rest).parts();
    EXPECT_EQ(parts.size(), 3u);
    for (const WheelNoise::Part& part : parts) {
      EXPECT_NEAR(part.variance, 1., 4. * part.sigma) << part.noise->parameter;
    }
  }
}

/// Slip along the rollers and three times less noise of the drives are one sum in each row. The sum
/// is as configured: neither may be told to be what both are together.
TEST(WheelNoise, TakesNoSourceForTwoThatLookAlike) {
  const auto model = load_model(
      "{type: mecanum, x_m: [0.2, -0.2, -0.2, 0.2], y_m: [0.18, 0.18, -0.18, -0.18], "
      "roller_angle_rad: [-0.7854, 0.7854, -0.7854, 0.7854], radius_m: 0.05, "
      "sigma_drive_rad_per_s: 0.02, sigma_slip_m_per_s: 0.003}");
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto parts = noise_after(model, {}, seed).parts();
    ASSERT_EQ(parts.size(), 1u);  // of the drives too little is seen
    EXPECT_EQ(parts[0].noise->kind, NoiseKind::kSlip);
    EXPECT_NEAR(parts[0].variance, 1., 4. * parts[0].sigma);
  }
}

/// Drive and slip of a side enter its row as one sum; a differential drive has no parity at all.
TEST(WheelNoise, TellsNothingThatTheRowsCannotTellApart) {
  const auto skid = load_model(
      "{type: skid_steer, radius_left_m: 0.1, radius_right_m: 0.1, y_icr_left_m: 0.3, "
      "y_icr_right_m: -0.3, left_drives: [1, 3], right_drives: [2, 4], "
      "sigma_drive_rad_per_s: 0.2, sigma_slip_m_per_s: 0.02}");
  EXPECT_TRUE(noise_after(skid, {}, 1, 0., 0., ahead).parts().empty());
  const auto differential = load_model(testing::differential());
  EXPECT_TRUE(noise_after(differential, {}, 1, 0., 0., ahead).parts().empty());
}

}  // namespace
}  // namespace viwo
