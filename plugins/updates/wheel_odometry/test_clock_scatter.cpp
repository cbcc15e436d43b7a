// Scores of the wheels' clock: white ones, and such as last for seconds.
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "clock_scatter.hpp"

namespace viwo::wheel_odometry {
namespace {

constexpr double kInterval_s = 0.1;

/// A minute of intervals whose scores have variance 4; `lag`, in sigmas of one of them, is said for
/// two seconds on end, this way or that.
ClockScatter drive(unsigned seed, double lag, double sigma = 2.) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  ClockScatter scatter;
  double said = 0.;
  for (int k = 0; k < 600; ++k) {
    if (k % 20 == 0) said = lag * normal(engine);
    scatter.add(kInterval_s, sigma * (normal(engine) + said), 4.);
  }
  return scatter;
}

TEST(ClockScatter, IsOneOfWhiteNoise) {
  for (unsigned seed = 1; seed <= 200; ++seed) EXPECT_EQ(drive(seed, 0.).factor(), 1.) << seed;
}

TEST(ClockScatter, FindsWhatLastsThoughEachIntervalIsHardlyLarger) {
  // Of 20 alike 20 times the variance of one lag: 1 + 20 * 0.7^2, and the root of that.
  double mean = 0.;
  constexpr int kSeeds = 100;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) mean += drive(seed, 0.7).factor() / kSeeds;
  EXPECT_NEAR(mean, 3.2, 0.3);
}

TEST(ClockScatter, FindsNoiseThatIsLargerThanSaid) {
  EXPECT_NEAR(drive(1, 0., 8.).factor(), 4., 1.5);
}

TEST(ClockScatter, SaysNothingWhereNothingWasTold) {
  ClockScatter scatter;
  std::vector<NoiseFound> found;
  for (int k = 0; k < 1000; ++k) scatter.add(kInterval_s, 0., 0.);
  scatter.append_to(found);
  EXPECT_TRUE(found.empty());
  drive(1, 2.).append_to(found);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].count, 600);
}

}  // namespace
}  // namespace viwo::wheel_odometry
