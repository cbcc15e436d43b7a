// Sigmas of the smoother over twenty robots that are far from nominal.
#include <cstdio>

#include <gtest/gtest.h>

#include "smoothed_swerve.hpp"

namespace viwo {
namespace {

TEST(SmootherNightly, SigmasAreRight) {
  constexpr std::uint64_t kSeeds = 20;
  for (const std::string motion : {"figure_eight", "icr_sweep"}) {
    double sum = 0.;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      const config::Node run = testing::swerve_run(seed, motion, testing::far_away());
      const smoother::Smoothed smoothed = testing::smoothed({run});
      EXPECT_TRUE(smoothed.converged) << motion << " " << seed;
      const double one = testing::mean_square(smoothed.calibration, smoothed.runs.front());
      std::printf("%s, seed %d: %.2f\n", motion.c_str(), static_cast<int>(seed), one);
      sum += one / kSeeds;
    }
    std::printf("%s: %.2f\n", motion.c_str(), sum);
    // At least five independent squares a seed.
    EXPECT_GT(sum, 0.67) << motion;
    EXPECT_LT(sum, 1.4) << motion;
  }
}

}  // namespace
}  // namespace viwo
