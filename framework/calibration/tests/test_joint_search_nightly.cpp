// The same as test_joint_search, for fifty seeds.
#include <iostream>

#include <gtest/gtest.h>

#include "unknown_swerve.hpp"

namespace viwo {
namespace {

TEST(JointSearch, FindsThemInFiftyOfFiftySeedsWithHonestSigmas) {
  const testing::Found found = testing::calibrate_unknown(50);
  std::cout << "worst " << found.most_rad << " rad, " << found.most_sigmas
            << " sigmas, mean square " << found.squares / found.count << "\n";
  EXPECT_LT(found.most_sigmas, 4.);
  // 99 % of a chi-square with 150 degrees of freedom, over its mean.
  EXPECT_GT(found.squares / found.count, 0.728);
  EXPECT_LT(found.squares / found.count, 1.322);
}

}  // namespace
}  // namespace viwo
