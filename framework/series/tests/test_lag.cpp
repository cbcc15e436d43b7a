// Lags between series of rates.
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "viwo/series/lag.hpp"

namespace viwo::series {
namespace {

TEST(FindLag, IsWithinItsOwnSigmaAndKnowsTheSign) {
  std::mt19937 random(1);
  std::normal_distribution<double> draw(0., 0.05);
  const auto rate = [](double t) { return std::sin(1.3 * t) + 0.5 * std::sin(0.4 * t * t / 10.); };
  for (const double lag_s : {0., 0.0234, -0.2}) {
    for (const double sign : {1., -1.}) {
      std::vector<Turn> a, b;
      for (std::int64_t i = 0; i < 6000; ++i) {
        const double t = 0.01 * static_cast<double>(i) + 0.005;
        const std::int64_t begin = i * 10'000'000;
        a.push_back({begin, begin + 10'000'000, {0., 0., rate(t) + draw(random)}});
        b.push_back({begin,
                     begin + 10'000'000,
                     {0., 0., sign * 1.2 * rate(t - lag_s) + 0.1 + draw(random)}});
      }
      const auto lag = find_lag(RateGrid(0, 60'000'000'000, a), RateGrid(0, 60'000'000'000, b));
      ASSERT_TRUE(lag);
      EXPECT_NEAR(lag->lag_s, lag_s, 4. * lag->sigma_s);
      EXPECT_LT(lag->sigma_s, 2e-3);
      EXPECT_NEAR(lag->correlation, sign, 0.02);
      EXPECT_NEAR(lag->slope, sign * 1.2, 0.02);
    }
  }
}

std::vector<Turn> turns(const std::function<Eigen::Vector3d(double)>& rate, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> draw(0., 0.05);
  std::vector<Turn> turns;
  for (std::int64_t i = 0; i < 6000; ++i) {
    const Eigen::Vector3d noise(draw(random), draw(random), draw(random));
    turns.push_back({i * 10'000'000, (i + 1) * 10'000'000,
                     rate(0.01 * static_cast<double>(i) + 0.005) + noise});
  }
  return turns;
}

RateGrid grid(const std::function<Eigen::Vector3d(double)>& rate, unsigned seed) {
  return {0, 60'000'000'000, turns(rate, seed)};
}

Eigen::Vector3d waving(double t) {
  return {std::sin(1.7 * t), std::cos(0.9 * t + 0.03 * t * t), std::sin(1.3 * t + 0.02 * t * t)};
}

TEST(FindLag, IsFoundFarAway) {
  for (const double lag_s : {1.2, -3.7, 15.}) {
    for (const double sign : {1., -1.}) {
      const auto lag =
          find_lag(grid(waving, 1),
                   grid([&](double t) -> Eigen::Vector3d { return sign * waving(t - lag_s); }, 2));
      ASSERT_TRUE(lag) << lag_s;
      EXPECT_NEAR(lag->lag_s, lag_s, 2. * lag->sigma_s);
      EXPECT_NEAR(lag->correlation, sign, 0.1);
      EXPECT_NEAR(lag->slope, sign, 0.1);
    }
  }
}

TEST(FindLag, IsNoneOfWhatSwingsOnItsOwn) {
  for (const double rate : {0.3, 1.1, 2.3}) {
    const auto lag =
        find_lag(grid(waving, 1), grid(
                                      [&](double t) -> Eigen::Vector3d {
                                        return Eigen::Vector3d(0.2, 0.5, 1.) * std::sin(rate * t);
                                      },
                                      2));
    EXPECT_TRUE(!lag || std::abs(lag->correlation) < 0.8);
  }
}

TEST(RotationBetween, IsNoneOfWhatHasNothingInCommon) {
  const Eigen::Matrix3d R =
      Eigen::AngleAxisd(1., Eigen::Vector3d(1., 2., 3.).normalized()).toRotationMatrix();
  const auto found = rotation_between(
      grid(waving, 1), grid([&](double t) -> Eigen::Vector3d { return R * waving(t - 0.2); }, 2));
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->isApprox(R, 0.05));
  // Later than it looks for, of a constant turn nothing but noise, or of something else.
  const auto late = [](double t) { return waving(t - 1.5); };
  const auto constant = [](double) { return Eigen::Vector3d(0., 0., 1.); };
  const auto other = [](double t) -> Eigen::Vector3d { return waving(60. - t).cwiseAbs(); };
  EXPECT_FALSE(rotation_between(grid(waving, 1), grid(late, 2)));
  EXPECT_FALSE(rotation_between(grid(constant, 1), grid(constant, 2)));
  EXPECT_FALSE(rotation_between(grid(waving, 1), grid(other, 2)));
}

TEST(FindLag, IsNothingWithoutRotation) {
  std::vector<Turn> still;
  for (std::int64_t i = 0; i < 6000; ++i) {
    still.push_back({i * 10'000'000,
                     (i + 1) * 10'000'000,
                     {0., 0., 0.01 * std::sin(0.01 * static_cast<double>(i))}});
  }
  const RateGrid grid(0, 60'000'000'000, still);
  EXPECT_FALSE(find_lag(grid, grid));
}

}  // namespace
}  // namespace viwo::series
