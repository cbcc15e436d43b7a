// Lags between series of rates.
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

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
