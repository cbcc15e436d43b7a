// Random streams: fixed algorithm, right moments, independence.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "viwo/sim/random.hpp"

namespace viwo::sim {
namespace {

TEST(RandomStream, GivesTheNumbersOfAnIndependentImplementation) {
  // From a separate Python program for SplitMix64, MT19937-64 and Box-Muller, seed 42, purpose 3.
  RandomStream uniform(42, Stream::kSlip);
  EXPECT_EQ(uniform.uniform(), 0.47231865291308694);
  EXPECT_EQ(uniform.uniform(), 0.03653108299820906);
  EXPECT_EQ(uniform.uniform(), 0.5058622257029125);
  RandomStream gaussian(42, Stream::kSlip);
  EXPECT_NEAR(gaussian.gaussian(), 1.1010636885245284, 1e-14);
  EXPECT_NEAR(gaussian.gaussian(), 0.2572627593430074, 1e-14);
}

TEST(RandomStream, GaussianHasTheMomentsOfTheNormalDistribution) {
  RandomStream stream(1, Stream::kDriveNoise);
  const int n = 200'000;
  double sum = 0., sum2 = 0., sum4 = 0., lag = 0., last = 0.;
  int beyond_two = 0;
  for (int i = 0; i < n; ++i) {
    const double x = stream.gaussian();
    sum += x;
    sum2 += x * x;
    sum4 += x * x * x * x;
    lag += x * last;
    last = x;
    beyond_two += std::abs(x) > 2. ? 1 : 0;
  }
  const double sigma = 1. / std::sqrt(n);  // bounds: four standard deviations of each statistic
  EXPECT_NEAR(sum / n, 0., 4. * sigma);
  EXPECT_NEAR(sum2 / n, 1., 4. * sigma * std::sqrt(2.));
  EXPECT_NEAR(sum4 / n, 3., 4. * sigma * std::sqrt(96.));
  EXPECT_NEAR(lag / n, 0., 4. * sigma);
  const double p = 0.04550026389635842;
  EXPECT_NEAR(static_cast<double>(beyond_two) / n, p, 4. * sigma * std::sqrt(p * (1. - p)));
}

TEST(RandomStream, DiffersBetweenPurposesAndSeeds) {
  const int n = 20'000;
  RandomStream a(1, Stream::kDriveNoise), b(1, Stream::kSteerNoise), c(2, Stream::kDriveNoise);
  double ab = 0., ac = 0.;
  for (int i = 0; i < n; ++i) {
    const double x = a.gaussian();
    ab += x * b.gaussian();
    ac += x * c.gaussian();
  }
  EXPECT_NEAR(ab / n, 0., 4. / std::sqrt(n));
  EXPECT_NEAR(ac / n, 0., 4. / std::sqrt(n));
}

}  // namespace
}  // namespace viwo::sim
