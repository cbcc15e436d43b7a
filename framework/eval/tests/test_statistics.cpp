// Statistics and chi-square bounds against values worked out by hand or printed in tables.
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include <Eigen/Dense>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "viwo/eval/consistency.hpp"
#include "viwo/eval/statistics.hpp"
#include "viwo/math/chi2.hpp"

namespace viwo::eval {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Statistics, AgreeWithHandComputedValues) {
  const std::array<double, 4> values{4., 1., 3., 8.};
  EXPECT_DOUBLE_EQ(mean(values), 4.);
  EXPECT_DOUBLE_EQ(median(values), 3.5);
  EXPECT_DOUBLE_EQ(root_mean_square(values), std::sqrt(90. / 4.));
  EXPECT_DOUBLE_EQ(sample_standard_deviation(values), std::sqrt(26. / 3.));
  EXPECT_DOUBLE_EQ(quantile(values, 0.), 1.);
  EXPECT_DOUBLE_EQ(quantile(values, 0.25), 2.5);
  EXPECT_DOUBLE_EQ(quantile(values, 0.9), 4. + 0.7 * 4.);
  EXPECT_DOUBLE_EQ(quantile(values, 1.), 8.);
}

TEST(Statistics, OfTooFewValuesAreNotNumbers) {
  const std::array<double, 1> one{2.};
  EXPECT_TRUE(std::isnan(mean({})));
  EXPECT_TRUE(std::isnan(median({})));
  EXPECT_TRUE(std::isnan(root_mean_square({})));
  EXPECT_TRUE(std::isnan(sample_standard_deviation(one)));
  EXPECT_DOUBLE_EQ(median(one), 2.);
}

TEST(Statistics, MedianSurvivesADivergedRunButNotANaN) {
  EXPECT_DOUBLE_EQ(median(std::array<double, 3>{1., kInfinity, 2.}), 2.);
  EXPECT_TRUE(std::isnan(median(std::array<double, 3>{1., kNaN, 2.})));
}

TEST(Statistics, QuantileRefusesAProbabilityBeyondOne) {
  EXPECT_THROW(quantile(std::array<double, 2>{1., 2.}, 1.1), std::invalid_argument);
  EXPECT_THROW(quantile(std::array<double, 2>{1., 2.}, kNaN), std::invalid_argument);
}

TEST(PairedDifference, HasTheIntervalOfTheTTable) {
  const std::array<double, 5> a{11., 22., 33., 44., 55.};
  const std::array<double, 5> b{10., 20., 30., 40., 50.};
  const PairedDifference difference = paired_difference(a, b);
  EXPECT_EQ(difference.pairs, 5);
  EXPECT_DOUBLE_EQ(difference.mean, 3.);
  EXPECT_DOUBLE_EQ(difference.standard_deviation, std::sqrt(2.5));
  // t(0.975, 4) = 2.776 in every table.
  EXPECT_NEAR(difference.low, 3. - 2.776445 * std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(difference.high, 3. + 2.776445 * std::sqrt(0.5), 1e-6);
  // t(0.95, 4) = 2.132
  EXPECT_NEAR(paired_difference(a, b, 0.9).high, 3. + 2.131847 * std::sqrt(0.5), 1e-6);
}

TEST(PairedDifference, LeavesOutPairsWithADivergedRun) {
  const std::array<double, 4> a{1., kNaN, 3., 4.};
  const std::array<double, 4> b{0., 0., kInfinity, 1.};
  const PairedDifference difference = paired_difference(a, b);
  EXPECT_EQ(difference.pairs, 2);
  EXPECT_DOUBLE_EQ(difference.mean, 2.);
  EXPECT_NEAR(difference.high, 2. + 12.706205, 1e-5);  // sd / sqrt(2) = 1, t(0.975, 1) = 12.706
}

TEST(PairedDifference, OfOnePairHasNoInterval) {
  const PairedDifference difference =
      paired_difference(std::array<double, 1>{2.}, std::array<double, 1>{0.5});
  EXPECT_DOUBLE_EQ(difference.mean, 1.5);
  EXPECT_TRUE(std::isnan(difference.low));
  EXPECT_TRUE(std::isnan(difference.high));
}

TEST(PairedDifference, RefusesSamplesOfDifferentSize) {
  const std::array<double, 2> two{1., 2.};
  EXPECT_THROW(paired_difference(two, std::array<double, 1>{1.}), std::invalid_argument);
  EXPECT_THROW(paired_difference(two, two, 1.), std::invalid_argument);
}

TEST(ChiSquare, QuantilesAreThoseOfTheTable) {
  EXPECT_NEAR(chi2_quantile(0.95, 1), 3.841, 5e-4);
  EXPECT_NEAR(chi2_quantile(0.95, 6), 12.592, 5e-4);
  EXPECT_NEAR(chi2_quantile(0.99, 3), 11.345, 5e-4);
  EXPECT_NEAR(chi2_quantile(0.025, 100), 74.222, 5e-4);
  EXPECT_NEAR(chi2_quantile(0.975, 100), 129.561, 5e-4);
  EXPECT_NEAR(chi2_quantile(0.5, 2), 2. * std::log(2.), 1e-12);
}

TEST(MeanNees, BoundsAreTheTableValuesOfTheSumOverTheRuns) {
  // Bar-Shalom's example: 50 runs of two states, 95 %: [1.5, 2.6].
  const NeesBounds bounds = mean_nees_bounds(2, 50, 0.95);
  EXPECT_NEAR(bounds.low, 74.222 / 50., 1e-4);
  EXPECT_NEAR(bounds.high, 129.561 / 50., 1e-4);
  // One run of one state: 0.025 and 0.975 quantiles of chi-square(1).
  EXPECT_NEAR(mean_nees_bounds(1, 1, 0.95).low, 0.000982, 1e-6);
  EXPECT_NEAR(mean_nees_bounds(1, 1, 0.95).high, 5.024, 5e-4);
  EXPECT_THROW(mean_nees_bounds(0, 1, 0.95), std::invalid_argument);
  EXPECT_THROW(mean_nees_bounds(1, 0, 0.95), std::invalid_argument);
  EXPECT_THROW(mean_nees_bounds(1, 1, 1.), std::invalid_argument);
}

TEST(Nees, OfCorrelatedErrorsIsTheClosedForm) {
  const Eigen::Vector2d error(1., 2.);
  Eigen::Matrix2d cov;
  cov << 2., 1., 1., 3.;
  // inverse: [3 -1; -1 2] / 5
  EXPECT_NEAR(nees(error, cov), (3. * 1. - 2. * 1. * 2. + 2. * 4.) / 5., 1e-14);
}

TEST(Nees, OfACovarianceThatIsNotOneIsNotANumber) {
  const Eigen::Vector2d error(1., 1.);
  Eigen::Matrix2d cov;
  cov << 1., 2., 2., 1.;
  EXPECT_TRUE(std::isnan(nees(error, cov)));
  EXPECT_TRUE(std::isnan(nees(error, Eigen::Matrix2d::Constant(kNaN))));
  EXPECT_THROW(nees(error, Eigen::Matrix3d::Identity()), std::invalid_argument);
}

TEST(Nees, TellsAnHonestCovarianceFromOneThatIsFourTimesTooSmall) {
  constexpr int kRuns = 200;
  std::mt19937_64 random(7);
  std::normal_distribution<double> gauss;
  const Eigen::Matrix3d L =
      (Eigen::Matrix3d() << 1., 0., 0., 0.5, 2., 0., -1., 0.3, 0.1).finished();
  const Eigen::Matrix3d cov = L * L.transpose();
  double sum = 0.;
  double sum_small = 0.;
  for (int run = 0; run < kRuns; ++run) {
    const Eigen::Vector3d error = L * Eigen::Vector3d(gauss(random), gauss(random), gauss(random));
    sum += nees(error, cov);
    sum_small += nees(error, cov / 4.);
  }
  const NeesBounds bounds = mean_nees_bounds(3, kRuns, 0.999);
  EXPECT_GT(sum / kRuns, bounds.low);
  EXPECT_LT(sum / kRuns, bounds.high);
  EXPECT_GT(sum_small / kRuns, bounds.high);
}

}  // namespace
}  // namespace viwo::eval
