// Ground or noise.
#include <random>

#include <gtest/gtest.h>

#include "ground_tilt.hpp"

namespace viwo::wheel_odometry {
namespace {

constexpr double kSigma = 5e-5;
constexpr double kDurationS = 0.1;

/// How often ground is seen after each of the intervals of a drive that turns now and then, with a
/// mount that is off, over ground that tilts each interval by `ground_rad` (standard deviation).
double seen(double ground_rad, double sigmas, int intervals = 2000) {
  std::mt19937_64 rng(5);
  std::normal_distribution<double> gauss;
  GroundTilt tilt(sigmas);
  int often = 0;
  for (int i = 0; i < intervals; ++i) {
    const double yaw = 0.1 * std::sin(0.05 * i);
    const double scatter = std::hypot(ground_rad, kSigma);
    tilt.add(kDurationS, yaw,
             {0.01 * yaw + scatter * gauss(rng), -0.02 * yaw + scatter * gauss(rng)},
             kSigma * kSigma);
    often += tilt.tilts() ? 1 : 0;
  }
  return static_cast<double>(often) / intervals;
}

TEST(GroundTilt, IsNoneOfNoiseAndOfAMountThatIsOff) {
  EXPECT_EQ(seen(0., 5.), 0.);
  EXPECT_GT(seen(0., 0.), 0.1);  // without a margin noise is ground
}

TEST(GroundTilt, IsSeenAtOnceWhereTheGroundTilts) { EXPECT_EQ(seen(5e-3, 5.), 1.); }

// A turn that does not change is a bias of the gyro, as far as that may be so large.
TEST(GroundTilt, IsNoneOfABiasOfTheGyro) {
  const auto tilts = [](double rate, double sigma_of_bias) {
    GroundTilt tilt(5.);
    for (int i = 0; i < 4; ++i) {
      tilt.add(kDurationS, 0.01 * i, kDurationS * Eigen::Vector2d(0., rate), kSigma * kSigma,
               sigma_of_bias * sigma_of_bias);
    }
    return tilt.tilts();
  };
  const double rate = 5. * kSigma / kDurationS;
  EXPECT_TRUE(tilts(rate, 0.));
  EXPECT_TRUE(tilts(rate, 0.02 * rate));
  EXPECT_FALSE(tilts(rate, 0.5 * rate));
  EXPECT_TRUE(tilts(10. * rate, 0.5 * rate));
}

TEST(GroundTilt, IsUnknownBeforeThereIsAnInterval) {
  GroundTilt tilt(5.);
  EXPECT_FALSE(tilt.tilts());
  tilt.add(kDurationS, 0.1, {0.01, 0.01}, 0.);
  tilt.add(kDurationS, std::nan(""), {0.01, 0.01}, 1e-8);
  tilt.add(0., 0.1, {0.01, 0.01}, 1e-8);
  EXPECT_FALSE(tilt.tilts());
  EXPECT_TRUE(tilt.expected(kDurationS).isZero());
}

TEST(GroundTilt, FollowsFromFlatGroundToUnevenAndBack) {
  std::mt19937_64 rng(6);
  std::normal_distribution<double> gauss;
  GroundTilt tilt(5.);
  const auto drive = [&](double ground_rad, int intervals) {
    for (int i = 0; i < intervals; ++i) {
      const double scatter = std::hypot(ground_rad, kSigma);
      tilt.add(kDurationS, 0.05, {scatter * gauss(rng), scatter * gauss(rng)}, kSigma * kSigma);
    }
    return tilt.tilts();
  };
  EXPECT_FALSE(drive(0., 300));
  EXPECT_TRUE(drive(5e-3, 5));
  EXPECT_TRUE(drive(5e-3, 100));
  EXPECT_FALSE(drive(0., 1500));
}

/// Products of what is expected of an interval with its noise, with its tilt, and with itself, all
/// over what the tilt has with itself. The noise of an orientation is in the tilts of two
/// intervals, with both signs.
struct Products {
  double noise = 0., tilt = 0., itself = 0.;
};
Products products(double per_interval, bool of_itself = false) {
  std::mt19937_64 rng(7);
  constexpr double kNoise = 4e-4;
  std::normal_distribution<double> gauss(0., kNoise);
  GroundTilt tilt(5.);
  Products sum;
  double squares = 0.;
  double before = gauss(rng);
  for (int i = 0; i < 20000; ++i) {
    const double now = gauss(rng);
    const Eigen::Vector2d ground =
        2e-3 * Eigen::Vector2d(std::sin(per_interval * i), std::cos(0.7 * per_interval * i));
    const Eigen::Vector2d noise(now - before, before - now);
    const Eigen::Vector2d seen = ground + noise;
    const Eigen::Vector2d expected = of_itself ? seen : tilt.expected(kDurationS);
    if (i > 100) {
      sum.noise += expected.dot(noise);
      sum.tilt += expected.dot(ground);
      sum.itself += expected.squaredNorm();
      squares += ground.squaredNorm();
    }
    tilt.add(kDurationS, 0., seen, 2. * kNoise * kNoise);
    before = now;
  }
  return {sum.noise / squares, sum.tilt / squares, sum.itself / squares};
}

TEST(GroundTilt, WhatIsExpectedSharesNoNoiseWithTheInterval) {
  EXPECT_NEAR(products(0.05).noise, 0., 0.01);
  EXPECT_GT(products(0.05, true).noise, 0.1);  // the tilt of the interval itself does
}

TEST(GroundTilt, WhatIsExpectedTeachesNoMoreThanItTellsOfTheTilt) {
  const Products smooth = products(0.05);
  EXPECT_NEAR(smooth.itself, smooth.tilt, 0.02);
  EXPECT_GT(smooth.tilt, 0.8);
  // Ground that two intervals later is another tells nothing, rather than something wrong.
  const Products rough = products(0.8);
  EXPECT_LT(rough.itself, 0.1);
  EXPECT_NEAR(rough.itself, rough.tilt, 0.02);
}

TEST(GroundTilt, WhatIsExpectedGoesWithTheLengthOfTheInterval) {
  GroundTilt tilt(0.);
  for (int i = 0; i < 10; ++i) tilt.add(0.1, 0., {1e-2, -2e-2}, 1e-10);
  EXPECT_NEAR(tilt.expected(0.1).x(), 1e-2, 1e-4);
  EXPECT_NEAR(tilt.expected(0.05).y(), -1e-2, 1e-4);
}

/// Alike after `intervals` over ground whose tilt is `ground(i)`.
template <class Ground>
double alike(int intervals, const Ground& ground) {
  std::mt19937_64 rng(8);
  std::normal_distribution<double> gauss(0., kSigma);
  GroundTilt tilt(5.);
  for (int i = 0; i < intervals; ++i) {
    tilt.add(kDurationS, 0., {ground(i) + gauss(rng), gauss(rng)}, kSigma * kSigma);
  }
  return tilt.alike();
}

TEST(GroundTilt, WhatIsNotExpectedIsAlikeInIntervalsThatFollowEachOther) {
  // At the start of a slope nothing is known of it: all intervals together are one.
  EXPECT_NEAR(alike(3, [](int) { return 5e-3; }), 3. * 4., 2.);
  // Waves are expected too late, for a part of their length.
  const double of_waves = alike(2000, [](int i) { return 5e-3 * std::sin(0.1 * i); });
  EXPECT_GT(of_waves, 4.);
  EXPECT_LT(of_waves, M_PI / 0.1);
  // Stones, one after the other, are not; nor is noise on flat ground.
  std::mt19937_64 rng(9);
  std::normal_distribution<double> stones(0., 5e-3);
  EXPECT_LT(alike(2000, [&](int) { return stones(rng); }), 1.5);
  EXPECT_EQ(alike(2000, [](int) { return 0.; }), 1.);
}

}  // namespace
}  // namespace viwo::wheel_odometry
