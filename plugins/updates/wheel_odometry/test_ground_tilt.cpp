// Ground or noise.
#include <random>

#include <gtest/gtest.h>

#include "ground_tilt.hpp"

namespace viwo::wheel_odometry {
namespace {

constexpr double kSigma = 5e-5;

/// Largest share after each of the intervals of a drive that turns now and then, with a mount that
/// is off, over ground that tilts each interval by `ground_rad` (standard deviation).
double largest_share(double ground_rad, double sigmas, int intervals = 2000) {
  std::mt19937_64 rng(5);
  std::normal_distribution<double> gauss;
  GroundTilt tilt(sigmas);
  double largest = 0.;
  for (int i = 0; i < intervals; ++i) {
    const double yaw = 0.1 * std::sin(0.05 * i);
    const double scatter = std::hypot(ground_rad, kSigma);
    tilt.add(yaw, {0.01 * yaw + scatter * gauss(rng), -0.02 * yaw + scatter * gauss(rng)},
             kSigma * kSigma);
    largest = std::max(largest, tilt.share());
  }
  return largest;
}

TEST(GroundTilt, IsNoneOfNoiseAndOfAMountThatIsOff) {
  EXPECT_EQ(largest_share(0., 5.), 0.);
  EXPECT_GT(largest_share(0., 0.), 0.1);  // without a margin noise is ground
}

TEST(GroundTilt, IsAllWhereTheGroundTilts) {
  EXPECT_GT(largest_share(5e-3, 5.), 0.999);
  // At once: the first intervals are enough.
  EXPECT_GT(largest_share(5e-3, 5., 3), 0.99);
}

TEST(GroundTilt, IsUnknownBeforeThereIsAnInterval) {
  GroundTilt tilt(5.);
  EXPECT_EQ(tilt.share(), 0.);
  tilt.add(0.1, {0.01, 0.01}, 0.);
  tilt.add(std::nan(""), {0.01, 0.01}, 1e-8);
  EXPECT_EQ(tilt.share(), 0.);
}

TEST(GroundTilt, FollowsFromFlatGroundToUnevenAndBack) {
  std::mt19937_64 rng(6);
  std::normal_distribution<double> gauss;
  GroundTilt tilt(5.);
  const auto drive = [&](double ground_rad, int intervals) {
    for (int i = 0; i < intervals; ++i) {
      const double scatter = std::hypot(ground_rad, kSigma);
      tilt.add(0.05, {scatter * gauss(rng), scatter * gauss(rng)}, kSigma * kSigma);
    }
    return tilt.share();
  };
  EXPECT_EQ(drive(0., 300), 0.);
  EXPECT_GT(drive(5e-3, 5), 0.98);
  EXPECT_GT(drive(5e-3, 100), 0.999);
  EXPECT_EQ(drive(0., 1500), 0.);
}

}  // namespace
}  // namespace viwo::wheel_odometry
