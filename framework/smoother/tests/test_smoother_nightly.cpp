// Sigmas of the smoother over twenty robots that are far from nominal.
#include <cstdio>

#include <gtest/gtest.h>

#include "smoothed_swerve.hpp"

namespace viwo {
namespace {

TEST(SmootherNightly, SigmasAreRight) {
  constexpr std::uint64_t kSeeds = 20;
  int unsettled = 0;  // which says so
  for (const std::string motion : {"figure_eight", "icr_sweep"}) {
    double sum = 0.;
    int settled = 0;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      const config::Node run = testing::swerve_run(seed, motion, testing::far_away());
      const smoother::Smoothed smoothed = testing::smoothed({run});
      if (!smoothed.converged) {
        std::printf("%s, seed %d: goes round\n", motion.c_str(), static_cast<int>(seed));
        ++unsettled;
        continue;
      }
      ++settled;
      const double one = testing::mean_square(smoothed.calibration, smoothed.runs.front());
      std::printf("%s, seed %d: %.2f\n", motion.c_str(), static_cast<int>(seed), one);
      sum += one;
    }
    sum /= settled;
    std::printf("%s: %.2f\n", motion.c_str(), sum);
    // At least five independent squares a seed.
    EXPECT_GT(sum, 0.67) << motion;
    EXPECT_LT(sum, 1.4) << motion;
  }
  EXPECT_LE(unsettled, 2);
}

}  // namespace
}  // namespace viwo
