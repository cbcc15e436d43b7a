// Turns within their noise: those that go on, and those that are none.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "small_turn.hpp"

namespace viwo::wheel_odometry {
namespace {

constexpr double kSigma = 4e-5;
constexpr double kDurationS = 0.1;

/// Of what is expected over many intervals: its product with the noise of the interval and with
/// the turn, both over the turn's with itself, and the mean of its square.
struct Products {
  double noise = 0., turn = 0., squares = 0.;
};

/// A turn that comes and goes with an amplitude of `turn` sigmas, beside one of `lasting` sigmas
/// that calibration may feign.
Products products(double turn, double lasting = 0.) {
  std::mt19937_64 rng(7);
  std::normal_distribution<double> gauss(0., kSigma);
  SmallTurn memory(5.);
  Products sum;
  constexpr int kIntervals = 20000;
  for (int i = 0; i < kIntervals; ++i) {
    const double true_turn = turn * kSigma * std::sin(0.1 * i);
    const double noise = gauss(rng);
    const double expected = memory.expected(kDurationS);
    sum.noise += expected * noise;
    sum.turn += expected * true_turn;
    sum.squares += expected * expected / kIntervals;
    memory.add(kDurationS, true_turn + lasting * kSigma + noise, kSigma * kSigma,
               lasting * lasting * kSigma * kSigma);
  }
  const double whole =
      turn > 0. ? 0.5 * kIntervals * turn * turn * kSigma * kSigma : kIntervals * kSigma * kSigma;
  return {sum.noise / whole, sum.turn / whole, sum.squares};
}

TEST(SmallTurn, IsExpectedWithoutTheNoiseOfTheInterval) {
  const Products of_three = products(3.);
  EXPECT_GT(of_three.turn, 0.7);
  EXPECT_NEAR(of_three.noise, 0., 0.02);
}

TEST(SmallTurn, IsNoneOfNoise) { EXPECT_LT(products(0.).squares, 1e-3 * kSigma * kSigma); }

TEST(SmallTurn, IsNoneThatWheelsThatAreNotCalibratedYetMayFeign) {
  EXPECT_LT(products(0., 2.).squares, 1e-3 * kSigma * kSigma);
}

TEST(SmallTurn, IsForgottenAfterALargeOneAndSoonAfterSmallOnes) {
  std::mt19937_64 rng(11);
  std::normal_distribution<double> gauss(0., kSigma);
  const auto after = [&](double turn) {
    SmallTurn memory(5.);
    for (int i = 0; i < 500; ++i) memory.add(kDurationS, turn + gauss(rng), kSigma * kSigma, 0.);
    int expected = 0;
    for (int i = 0; i < 500; ++i) {
      memory.add(kDurationS, gauss(rng), kSigma * kSigma, 0.);
      expected += memory.expected(kDurationS) != 0. ? 1 : 0;
    }
    return expected;
  };
  EXPECT_EQ(after(0.05), 0);
  EXPECT_GT(after(4. * kSigma), 30);  // nobody knows at once that it is over
  EXPECT_LT(after(4. * kSigma), 150);
}

TEST(SmallTurn, IsUnknownBeforeThereIsAnInterval) {
  SmallTurn turn(5.);
  EXPECT_EQ(turn.expected(kDurationS), 0.);
  turn.add(0., 1e-3, 1e-9, 0.);
  turn.add(kDurationS, std::nan(""), 1e-9, 0.);
  EXPECT_EQ(turn.expected(kDurationS), 0.);
}

TEST(SmallTurn, GoesWithTheLengthOfTheInterval) {
  SmallTurn turn(5.);
  for (int i = 0; i < 50; ++i) turn.add(0.1, 1e-3, 1e-8, 0.);
  EXPECT_NEAR(turn.expected(0.1), 1e-3, 1e-6);
  EXPECT_NEAR(turn.expected(0.05), 5e-4, 1e-6);
}

}  // namespace
}  // namespace viwo::wheel_odometry
