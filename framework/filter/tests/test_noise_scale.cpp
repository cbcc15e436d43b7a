// The scale of a noise that is found while it runs, and factors with heavy tails.
#include <cmath>
#include <optional>
#include <random>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "viwo/filter/covariance.hpp"
#include "viwo/math/chi2.hpp"

namespace viwo {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kSigma = 0.05;  // of its measurements, as configured

/// A position that walks, and a filter that measures it with noise of `true_scale` kSigma.
class Walk {
 public:
  /// The position walks by `walk_m` in a step.
  Walk(unsigned seed, double true_scale, double walk_m = 0.02)
      : rng_(seed), true_scale_(true_scale), walk_m_(walk_m) {
    covariance_.set_block(kPositionColumn, 0.01 * MatrixXd::Identity(3, 3));
    for (int i = 0; i < 3; ++i) truth_[i] = 0.1 * gauss_(rng_);
    walk_.Q.diagonal().segment<3>(kPositionColumn).setConstant(walk_m * walk_m);
    factor_.columns.add(kPositionColumn, 3);
    factor_.set_rows(3);
    factor_.H.setIdentity();
    factor_.R = kSigma * kSigma * MatrixXd::Identity(3, 3);
    factor_.gate_probability = 0.001;
    factor_.heavy_tailed = true;
  }
  Walk(const Walk&) = delete;

  ResidualFactor& factor() { return factor_; }
  void set_true_scale(double scale) { true_scale_ = scale; }
  void set_heavy_tailed() { heavy_tailed_ = true; }

  FactorResult step(const Vector3d& outlier = Vector3d::Zero()) {
    for (int i = 0; i < 3; ++i) truth_[i] += walk_m_ * gauss_(rng_);
    covariance_.propagate(walk_);
    Vector3d noise;
    for (int i = 0; i < 3; ++i) noise[i] = true_scale_ * kSigma * gauss_(rng_);
    if (heavy_tailed_) {  // Student's t with three degrees of freedom
      std::chi_squared_distribution<double> chi2(3.);
      noise *= std::sqrt(3. / chi2(rng_));
    }
    factor_.residual = truth_ + noise + outlier - estimate_;
    const FactorResult result = covariance_.apply(factor_, dx_);
    estimate_ += dx_.segment<3>(kPositionColumn);
    return result;
  }
  double nees() const {
    const Vector3d error = truth_ - estimate_;
    const Eigen::Matrix3d P = covariance_.matrix().block<3, 3>(kPositionColumn, kPositionColumn);
    return error.dot(P.inverse() * error);
  }
  double error_m() const { return (truth_ - estimate_).norm(); }

 private:
  std::mt19937_64 rng_;
  std::normal_distribution<double> gauss_;
  double true_scale_, walk_m_;
  bool heavy_tailed_ = false;
  Covariance covariance_{kImuSize};
  ImuTransition walk_{ImuMatrix::Identity(), ImuMatrix::Zero()};
  ResidualFactor factor_;
  Vector3d truth_ = Vector3d::Zero(), estimate_ = Vector3d::Zero();
  VectorXd dx_ = VectorXd::Zero(kImuSize);
};

class TrueScale : public ::testing::TestWithParam<double> {};

TEST_P(TrueScale, IsFoundAndMakesTheFilterConsistent) {
  constexpr int kRuns = 300;
  double nees = 0., nees_as_configured = 0., found = 0.;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    NoiseScale noise;
    Walk with(seed, GetParam()), without(seed, GetParam());
    with.factor().noise = &noise;
    for (int i = 0; i < 1000; ++i) {
      with.step();
      without.step();
    }
    nees += with.nees();
    nees_as_configured += without.nees();
    found += noise.scale() / kRuns;
  }
  EXPECT_NEAR(found / GetParam(), 1., 0.03);
  const double low = chi2_quantile(0.005, 3 * kRuns), high = chi2_quantile(0.995, 3 * kRuns);
  EXPECT_GT(nees, low);
  EXPECT_LT(nees, high);
  // The same without it fails where the configured noise is wrong.
  const bool consistent = nees_as_configured > low && nees_as_configured < high;
  EXPECT_EQ(consistent, GetParam() == 1.);
}

INSTANTIATE_TEST_SUITE_P(NoiseScale, TrueScale, ::testing::Values(1., 2., 5.));

TEST(NoiseScale, IsReportedButNotBelievedWhereItIsSmallerThanConfigured) {
  NoiseScale noise;
  Walk walk(5, 0.5);
  walk.factor().noise = &noise;
  for (int i = 0; i < 5000; ++i) walk.step();
  // The filter, which believes in more noise, errs less than it says, so that less is found.
  EXPECT_LT(noise.found(), 0.5);
  EXPECT_GT(noise.found(), 0.25);
  EXPECT_NEAR(noise.scale(), 1., 0.02);
}

TEST(NoiseScale, IsRaisedLittleByOutliersThatAreFew) {
  NoiseScale noise;
  Walk walk(7, 1.);
  walk.factor().noise = &noise;
  std::mt19937_64 rng(8);
  int weakened = 0;
  for (int i = 0; i < 5000; ++i) {
    const bool is_outlier = rng() % 20 == 0;
    const FactorResult result = walk.step(is_outlier ? Vector3d(3., -2., 1.) : Vector3d::Zero());
    weakened += result == FactorResult::kWeakened;
  }
  // Were all of the innovation noise, a part e of outliers gave s^2 = (1 - e) / (1 - e gate / 3).
  const double gate = chi2_quantile(0.999, 3) / 3.;
  EXPECT_GT(noise.found(), 1.);
  EXPECT_LT(noise.found(), 1.1 * std::sqrt(0.95 / (1. - 0.05 * gate)));
  EXPECT_GT(weakened, 200);
  EXPECT_LT(walk.error_m(), 0.2);
}

TEST(NoiseScale, LetsMeasurementsInAgainThatAreTenTimesWorseThanWasThought) {
  NoiseScale noise;
  Walk walk(9, 10.);
  walk.factor().noise = &noise;
  int weakened = 0;
  for (int i = 0; i < 1000; ++i) {
    if (i == 500) weakened = 0;
    weakened += walk.step() == FactorResult::kWeakened;
  }
  EXPECT_LT(weakened, 15);
  // As it is without: most are beyond the gate for ever.
  Walk without(9, 10.);
  weakened = 0;
  for (int i = 0; i < 1000; ++i) weakened += without.step() == FactorResult::kWeakened;
  EXPECT_GT(weakened, 300);
}

/// Fraction of 4000 measurements beyond the gate, of a noise that is `true_scale(i)`.
template <class Scale>
double beyond(NoiseScale& noise, Walk& walk, const Scale& true_scale) {
  constexpr int kSteps = 4000;
  walk.factor().noise = &noise;
  int weakened = 0;
  for (int i = 0; i < kSteps; ++i) {
    walk.set_true_scale(true_scale(i));
    weakened += walk.step() == FactorResult::kWeakened;
  }
  return weakened / static_cast<double>(kSteps);
}

TEST(NoiseScale, FollowsANoiseThatComesAndGoes) {
  for (const double loud : {5., 15., 40.}) {
    NoiseScale noise(10., 60., 100.);
    Walk walk(13, 1.);
    // The scale has to be found again after 320 quiet measurements: e^(-320/60) is left of it.
    EXPECT_LT(beyond(noise, walk, [&](int i) { return i % 400 < 320 ? 1. : loud; }), 0.05);
  }
}

TEST(NoiseScale, LeavesFewBeyondTheGateThatAreHeavyTailed) {
  NoiseScale noise(10., 60., 100.);
  Walk walk(17, 1.);
  walk.set_heavy_tailed();
  const double fraction = beyond(noise, walk, [](int) { return 3.; });
  // More than the thousandth that a Gaussian has, and less than one in twenty.
  EXPECT_GT(fraction, 0.002);
  EXPECT_LT(fraction, 0.05);
}

TEST(NoiseScale, StaysAsConfiguredWhereThatIsRight) {
  NoiseScale noise(10., 60., 100.);
  Walk walk(19, 1.);
  double mean = 0.;
  EXPECT_LT(beyond(noise, walk,
                   [&](int) {
                     mean += noise.scale() / 4000.;
                     return 1.;
                   }),
            0.002);
  // Of 60 measurements: off by 1 / sqrt(6 N) at one sigma, and never below 1.
  EXPECT_LT(mean, 1. + 2. / std::sqrt(6. * 60.));
}

TEST(NoiseScale, BelievesTwoOfThreeInARowAndNotOneAlone) {
  NoiseScale noise(10., 60., 100.);
  noise.add_beyond_in_turn(5.);
  const double one = (59. / 60. * 10. + 5.) / (59. / 60. * 10. + 1.);
  EXPECT_NEAR(noise.variance(), one, 1e-12);
  noise.add_beyond_in_turn(5.);
  EXPECT_NEAR(noise.variance(), 0.25 * (2. * one + 5. + 5. * one), 1e-12);
  // Little else is remembered: as soon gone as come.
  for (int i = 0; i < 20; ++i) noise.add(1.);
  EXPECT_LT(noise.variance(), 1.6);
  NoiseScale between(10., 60., 100.);
  between.add_beyond_in_turn(5.);
  between.add(1.);
  const double before = between.variance();
  between.add_beyond_in_turn(5.);
  EXPECT_NEAR(between.variance(), 0.25 * (2. * before + 5. + 5. * before), 1e-12);
  NoiseScale apart(10., 60., 100.);
  apart.add_beyond_in_turn(5.);
  apart.add(1.);
  apart.add(1.);
  apart.add_beyond_in_turn(5.);
  EXPECT_LT(apart.variance(), 2.);
  noise.reset();
  EXPECT_EQ(noise.variance(), 1.);
  EXPECT_EQ(noise.count(), 0);
}

TEST(NoiseScale, StaysWithinItsBoundsAndCountsNothingThatIsNotFinite) {
  NoiseScale noise(10., 200., 5.);
  for (int i = 0; i < 10000; ++i) noise.add_beyond(1e6);
  EXPECT_EQ(noise.scale(), 5.);
  for (int i = 0; i < 10000; ++i) noise.add(0.);
  EXPECT_EQ(noise.scale(), 1.);
  const auto count = noise.count();
  noise.add(std::nan(""));
  EXPECT_EQ(noise.count(), count);
  noise.set_enabled(false);
  noise.add(1.);
  EXPECT_EQ(noise.count(), count);
}

TEST(HeavyTails, WeighAFactorDownUntilItIsAsLikelyAsItsGate) {
  const MatrixXd P = 0.04 * MatrixXd::Identity(kImuSize, kImuSize);
  ResidualFactor factor;
  factor.columns.add(kPositionColumn, 3);
  factor.set_rows(2);
  factor.H << 1., 0.2, 0., -0.3, 1., 0.5;
  factor.R << 0.01, 0.002, 0.002, 0.03;
  factor.residual << 3., -2.;
  factor.gate_probability = 0.01;
  Covariance covariance(kImuSize);
  covariance.set_block(0, P);
  VectorXd dx(kImuSize);
  EXPECT_EQ(covariance.apply(factor, dx), FactorResult::kGated);
  factor.heavy_tailed = true;
  ASSERT_EQ(covariance.apply(factor, dx), FactorResult::kWeakened);
  // The noise that makes it just so likely, by bisection.
  const double threshold = chi2_quantile(0.99, 2);
  const Eigen::Matrix2d HPHt = factor.H * 0.04 * factor.H.transpose();
  double low = 1., high = 1e6;
  for (int i = 0; i < 100; ++i) {
    const double middle = std::sqrt(low * high);
    const Eigen::Matrix2d S = HPHt + middle * factor.R;
    const Eigen::Vector2d r = factor.residual;
    (r.dot(S.inverse() * r) > threshold ? low : high) = middle;
  }
  const Eigen::Matrix2d S = HPHt + low * factor.R;
  const MatrixXd K = 0.04 * factor.H.transpose() * S.inverse();
  const VectorXd expected = K * factor.residual;
  EXPECT_LT((dx.segment<3>(kPositionColumn) - expected).norm(), 0.02 * expected.norm());
  const MatrixXd P_expected = P.topLeftCorner(3, 3) - K * factor.H * 0.04;
  EXPECT_LT((covariance.matrix().block<3, 3>(kPositionColumn, kPositionColumn) - P_expected).norm(),
            1e-3 * P_expected.norm());
}

TEST(HeavyTails, LetAnEstimateThatIsSureOfSomethingWrongComeBack) {
  for (const bool heavy_tailed : {true, false}) {
    Walk walk(11, 1., 0.001);
    walk.factor().heavy_tailed = heavy_tailed;
    for (int i = 0; i < 50; ++i) walk.step();
    // Sure to a centimetre, and shown something else: a gate alone would never let it see.
    for (int i = 0; i < 300; ++i) walk.step(Vector3d(0.5, 0.5, 0.));
    EXPECT_EQ(walk.error_m() > 0.3, heavy_tailed) << walk.error_m();
  }
}

}  // namespace
}  // namespace viwo
