// Allan deviations of noises that are known.
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "viwo/series/allan.hpp"

namespace viwo::series {
namespace {

TEST(AllanDeviation, IsThatOfWhiteNoiseAndOfARandomWalk) {
  std::mt19937 random(3);
  std::normal_distribution<double> draw(0., 1.);
  std::vector<double> white(1 << 16), walk(1 << 16);
  constexpr double kStep = 0.01;
  double sum = 0.;
  for (std::size_t i = 0; i < white.size(); ++i) {
    white[i] = draw(random) * 0.2 / std::sqrt(kStep);
    walk[i] = sum += draw(random) * 0.3 * std::sqrt(kStep);
  }
  for (const AllanPoint& point : allan_deviation(white, kStep)) {
    const double sigma = 2. / std::sqrt(2. * point.terms);
    if (point.terms < 100.) continue;
    EXPECT_NEAR(point.deviation * std::sqrt(point.tau_s), 0.2, 0.2 * 3. * sigma) << point.tau_s;
  }
  for (const AllanPoint& point : allan_deviation(walk, kStep)) {
    if (point.terms < 100. || point.tau_s < 0.1) continue;
    EXPECT_NEAR(point.deviation / std::sqrt(point.tau_s / 3.), 0.3,
                0.3 * 6. / std::sqrt(2. * point.terms))
        << point.tau_s;
  }
}

}  // namespace
}  // namespace viwo::series
