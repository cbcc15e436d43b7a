// Where rays meet, and how far points are to be expected.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "test_support.hpp"
#include "triangulation.hpp"

namespace viwo::visual {
namespace {

using testing::Random;

MetRays met_at(double rho, double sigma_rho, bool has_distance) {
  MetRays met;
  met.point.rho = rho;
  met.sigma_rho = sigma_rho;
  met.has_distance = has_distance;
  return met;
}

/// Points of a scene as noisy rays tell them, once it is known.
struct Sums {
  double truth = 0., found = 0., taken = 0., with_noise = 0.;  ///< mean squares of rho
  double error_found = 0., error_expected = 0.;

  Sums(double mean, double spread, double sigma, std::uint64_t seed) {
    Random random(seed);
    FoundDistances distances;
    const int n = 4000, learning = 1000;
    for (int i = 0; i < learning + n; ++i) {
      const double rho = mean + spread * testing::normal(random);
      MetRays met;
      met.sigma_rho = sigma * testing::uniform(random, 0.5, 1.5);
      met.point.rho = rho + met.sigma_rho * testing::normal(random);
      met.has_distance = met.point.rho > 4. * met.sigma_rho;
      const double as_found = met.point.rho, variance = met.sigma_rho * met.sigma_rho;
      distances.expect(true, met);
      distances.add(as_found, variance);
      if (i < learning) continue;
      truth += rho * rho / n;
      found += as_found * as_found / n;
      taken += met.point.rho * met.point.rho / n;
      with_noise += (met.point.rho * met.point.rho + met.sigma_rho * met.sigma_rho) / n;
      error_found += (as_found - rho) * (as_found - rho) / n;
      error_expected += (met.point.rho - rho) * (met.point.rho - rho) / n;
    }
  }
};

TEST(FoundDistances, GiveNoMoreOfTheWayThanIsThere) {
  // Mean, spread, and sigma of what is found of it.
  const std::vector<std::vector<double>> scenes{
      {0.0056, 0.0006, 0.0012},  // 150 to 210 m, 1.3 m of way
      {0.001, 0.0005, 0.004},    // 1 km
      {0.02, 0.02, 0.004},       // some near, some far
      {1.5, 0.4, 0.02}};         // a room
  for (const auto& scene : scenes) {
    const Sums sums(scene[0], scene[1], scene[2], 3);
    EXPECT_LT(sums.taken, 1.1 * sums.truth) << scene[0];
    EXPECT_GT(sums.with_noise, 0.9 * sums.truth) << scene[0];
    EXPECT_LT(sums.error_expected, 1.05 * sums.error_found) << scene[0];
  }
  // As they are found, those of a kilometre show the way a dozen times as well as they do.
  const Sums far(0.001, 0.0005, 0.004, 3);
  EXPECT_GT(far.found, 10. * far.truth);
}

TEST(FoundDistances, LeaveAFewPointsAsTheyAreFoundOrInfinitelyFar) {
  FoundDistances distances;
  for (int i = 0; i < 10; ++i) distances.add(0.2, 1e-6);
  MetRays told = met_at(0.5, 0.01, true);
  distances.expect(true, told);
  EXPECT_EQ(told.point.rho, 0.5);
  MetRays untold = met_at(0.03, 0.04, false);
  distances.expect(true, untold);
  EXPECT_EQ(untold.point.rho, 0.);
  EXPECT_DOUBLE_EQ(untold.sigma_rho, 0.05);
}

TEST(FoundDistances, LeaveAPointThatIsNotOfTheSceneWhereItWasFound) {
  Random random(4);
  FoundDistances distances;
  for (int i = 0; i < 2000; ++i) {
    const double sigma = 0.01;
    distances.add(0.001 + sigma * testing::normal(random), sigma * sigma);
  }
  for (const double sigma : {0.002, 0.03}) {  // better told than the scene is, and worse
    MetRays met = met_at(0.5, sigma, true);
    distances.expect(true, met);
    EXPECT_EQ(met.point.rho, 0.5) << sigma;
    EXPECT_EQ(met.sigma_rho, sigma) << sigma;
  }
}

// Points of a wall differ by less than each is off by: none of them is all that is known of it.
TEST(FoundDistances, AreOfAllPointsOfAWall) {
  Random random(5);
  FoundDistances distances;
  double squares = 0., worst = 0.;
  constexpr int kFirst = 1000, kLast = 6000;
  for (int i = 0; i < kLast; ++i) {
    const double sigma = 0.02 * (i % 4 == 0 ? 0.3 : i % 4 == 3 ? 3. : 1.);
    const double rho = 0.2 + 0.002 * testing::normal(random);
    distances.add(rho + sigma * testing::normal(random), sigma * sigma);
    if (i < kFirst) continue;
    const double error = distances.mean() - 0.2;
    squares += error * error;
    worst = std::max(worst, std::abs(error));
  }
  // The best that the last 300 points tell, by the inverses of their variances, is 0.0006.
  EXPECT_LT(std::sqrt(squares / (kLast - kFirst)), 0.001);
  EXPECT_LT(worst, 0.004);
}

TEST(FoundDistances, SayNothingWhereTheWayIsNotKnown) {
  FoundDistances distances;
  for (int i = 0; i < 100; ++i) distances.add(0.2, 1e-6);
  MetRays untold = met_at(0.03, 0.04, false);
  distances.expect(false, untold);
  EXPECT_EQ(untold.point.rho, 0.);
  EXPECT_DOUBLE_EQ(untold.sigma_rho, 0.05);
}

}  // namespace
}  // namespace viwo::visual
