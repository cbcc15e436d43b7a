// Joints as they are mounted: readings of logs against the motions of the joints that made them.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "joint_readings.hpp"
#include "viwo/log/joints.hpp"

namespace viwo::log {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kTurn = 2. * std::numbers::pi;

Numbers drives_of(const EncoderReading& reading) {
  return {reading.drive.begin(), reading.drive.begin() + reading.n_drive};
}
Numbers steers_of(const EncoderReading& reading) {
  return {reading.steer_rad.begin(), reading.steer_rad.begin() + reading.n_steer};
}

/// What [0, turn) shows of it.
double wrapped(double value, double turn) { return value - turn * std::floor(value / turn); }

TEST(Joints, LeaveEveryBitWhereNothingIsSaid) {
  JointMap map({}, 8, 8, false, 0.2);
  EncoderReading reading = reading_of(1., {-0., 0.1, 5e-324, -3., 9e3, 7., 1e-9, 2.},
                                      {-0., 4., -9., 1e-17, 0.3, 0.7, 2.2, 1.1});
  const EncoderReading before = reading;
  EXPECT_EQ(map.convert(reading), nullptr);
  EXPECT_EQ(std::memcmp(reading.drive.data(), before.drive.data(), sizeof before.drive), 0);
  EXPECT_EQ(std::memcmp(reading.steer_rad.data(), before.steer_rad.data(), sizeof before.steer_rad),
            0);
  EXPECT_EQ(reading.t_ns, before.t_ns);
  EXPECT_FALSE(reading.is_start);
}

TEST(Joints, AreScaledShiftedExchangedAveragedAndLeftOut) {
  JointParams params;
  params.drive_scale = {-1., 0.5, 2., 1., 10.};
  params.drive_channel = {2., 1., 2., 0., 1.};
  params.steer_scale = {-2., 1., 0.5};
  params.steer_shift_rad = {0.25, 5., -4.};
  params.steer_channel = {2., 0., 1.};
  JointMap map(params, 5, 3, false, 0.2);
  const EncoderReading out = converted(map, reading_of(0., {3., 8., 7., 99., 2.}, {1., 7., 6.}));
  EXPECT_THAT(drives_of(out), ElementsAre((4. + 20.) / 2., (-3. + 14.) / 2.));
  EXPECT_THAT(steers_of(out), ElementsAre(3. - 4., -2. + 0.25));
  EXPECT_EQ(out.drive[2], 0.) << "channels that are not used are zero";
  EXPECT_EQ(out.steer_rad[2], 0.);
}

/// A joint that moves as it likes, with its accelerations, in turns.
double wavy_turns(double t_s) { return 3. * std::sin(1.1 * t_s) + 1.7 * std::sin(2.3 * t_s); }

TEST(Joints, OfAngleEncodersTurnAsOftenAsTheJointDid) {
  for (const double turn : {360., 4096., kTurn}) {
    JointParams params;
    params.drive_scale = {-kTurn / turn};
    params.drive_turn = {turn};
    JointMap map(params, 1, 0, true, 0.2);
    double offset = 0.;
    for (int k = 0; k < 2000; ++k) {
      const double t_s = 0.02 * k, turns = wavy_turns(t_s);
      const auto out = converted(map, reading_of(t_s, {wrapped(turn * (turns + 0.4), turn)}));
      EXPECT_EQ(out.is_start, k == 0);
      if (k == 0) offset = out.drive[0] + kTurn * turns;
      ASSERT_NEAR(out.drive[0], offset - kTurn * turns, 1e-9) << t_s;
    }
  }
}

TEST(Joints, AreFollowedThroughReadingsThatAreMissingAndStampsThatBunch) {
  // Two turns a second at 10 Hz: with two readings missing the shorter way is the wrong one.
  JointParams params;
  params.drive_turn = {1.};
  JointMap map(params, 1, 0, true, 2.);
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> jitter(-0.02, 0.02);
  double at_turns = 0.;  // speeds up in a second
  for (int k = 0; k < 600; ++k) {
    at_turns += 0.2 * std::min(1., 0.1 * k);
    if (k > 20 && k % 40 < 2) continue;
    const auto out = converted(map, reading_of(0.1 * k + jitter(rng), {wrapped(at_turns, 1.)}));
    ASSERT_NEAR(out.drive[0], at_turns, 1e-9) << k;
  }
}

TEST(Joints, ThatMayHaveGoneAnotherTurnAreRejectedAndBeginAnew) {
  JointParams params;
  params.drive_turn = {1., 0.};
  JointMap map(params, 2, 0, true, 1.);
  for (int k = 0; k < 20; ++k) converted(map, reading_of(0.1 * k, {wrapped(0.2 * k, 1.), 5.}));
  // It stopped while two readings were missing: at 4 turns instead of the 4.4 that were expected.
  EncoderReading stopped = reading_of(2.2, {0., 5.});
  EXPECT_THAT(map.convert(stopped), HasSubstr("how many turns"));
  EncoderReading next = reading_of(2.3, {0., 5.});
  EXPECT_EQ(map.convert(next), nullptr);
  EXPECT_TRUE(next.is_start);
  EncoderReading second = reading_of(2.4, {0.1, 5.});
  EXPECT_EQ(map.convert(second), nullptr);
  EXPECT_FALSE(second.is_start);
  // The cells of it: none reaches over what is not known.
  EXPECT_TRUE(cells_from_angles(std::vector{reading_of(2.1, {4., 5.}), next}, 1.).empty());
  EXPECT_EQ(cells_from_angles(std::vector{next, second}, 1.).size(), 1U);
}

TEST(Joints, NeverGiveARateThatWasNotThereWhateverIsMissing) {
  std::mt19937_64 rng(2);
  std::uniform_real_distribution<double> uniform(0., 1.);
  JointParams params;
  params.drive_turn = {1.};
  int n_cells = 0, n_rejected = 0;
  for (int trial = 0; trial < 100; ++trial) {
    JointMap map(params, 1, 0, true, 0.2);
    // At 50 Hz up to 8 turns a second, with 2 g of a wheel of 0.1 m radius.
    double turns = 0., speed = 0., wanted = 0.;
    std::vector<EncoderReading> readings;
    std::vector<double> truth;
    for (int k = 0; k < 500; ++k) {
      if (uniform(rng) < 0.03) wanted = 16. * uniform(rng) - 8.;
      speed += std::clamp(wanted - speed, -0.6, 0.6);
      turns += 0.02 * speed;
      if (uniform(rng) < 0.3) continue;
      EncoderReading reading = reading_of(0.02 * k, {wrapped(turns, 1.)});
      if (map.convert(reading) != nullptr) {
        ++n_rejected;
        continue;
      }
      readings.push_back(reading);
      truth.push_back(turns);
    }
    std::size_t i = 1;
    for (const EncoderSample& cell : cells_from_angles(readings, 0.2)) {
      while (readings[i].t_ns != cell.end_ns) ++i;
      const double rate = (truth[i] - truth[i - 1]) / seconds_between(cell.begin_ns, cell.end_ns);
      ASSERT_NEAR(cell.drive_rad_per_s[0], rate, 1e-9) << trial << " " << cell.t_ns;
      ++n_cells;
    }
  }
  EXPECT_GT(n_cells, 30'000);
  EXPECT_GT(n_rejected, 0);
}

TEST(Joints, AreTakenAgainWhenTheLogGoesOnMoreSlowly) {
  JointParams params;
  params.drive_turn = {1.};
  JointMap map(params, 1, 0, true, 1.);
  int n_rejected = 0;
  double t_s = 0.;
  for (int k = 0; k < 200; ++k) {
    t_s += k < 100 ? 0.01 : 0.05;
    EncoderReading reading = reading_of(t_s, {wrapped(t_s, 1.)});
    if (map.convert(reading) == nullptr) continue;
    ++n_rejected;
    EXPECT_LT(k, 120);
  }
  EXPECT_GT(n_rejected, 0);
}

TEST(Joints, ThatSteerStayAsTheyAreReadWhereTheReadingComesRound) {
  JointParams params;
  params.steer_scale = {0.0174533};
  params.steer_shift_rad = {3.};
  params.steer_turn = {360.};
  JointMap map(params, 1, 1, false, 0.2);
  EXPECT_NEAR(converted(map, reading_of(0., {0.}, {359.})).steer_rad[0], 9.26573, 1e-4);
  EXPECT_NEAR(converted(map, reading_of(0.1, {0.}, {1.})).steer_rad[0], 3.01745, 1e-4);
  EXPECT_FALSE(converted(map, reading_of(9., {0.}, {1.})).is_start);
}

TEST(Joints, ThatSteerThroughAGearAreCountedUntilAGapMakesThemUnknown) {
  JointParams params;
  params.steer_scale = {kTurn / 4096. / 12.};
  params.steer_turn = {4096.};
  JointMap map(params, 1, 1, false, 0.2);
  const auto read = [](double t_s, double rad) {
    return reading_of(t_s, {0.}, {wrapped(rad * 12. / kTurn * 4096., 4096.)});
  };
  double t_s = 0.;
  for (; t_s < 5.; t_s += 0.02) {
    const double rad = 1.5 * std::sin(t_s);
    ASSERT_NEAR(converted(map, read(t_s, rad)).steer_rad[0], rad, 1e-9) << t_s;
  }
  for (t_s += 0.3; t_s < 6.; t_s += 0.02) {
    EncoderReading reading = read(t_s, 0.1);
    EXPECT_THAT(map.convert(reading), HasSubstr("lost count"));
  }
}

TEST(Joints, ThatADriveIsCoupledToAreTakenOffIt) {
  for (const bool is_angle : {false, true}) {
    JointParams params;
    params.steer_scale = {-1., 1.};
    params.drive_per_steer = {0.3, -0.2};
    JointMap map(params, 2, 2, is_angle, 0.2);
    EncoderReading last;
    for (int k = 0; k < 300; ++k) {
      // Both modules turn round and round, at 2 rad/s and -1 rad/s; wheels roll at 4 and 5 rad/s.
      const double t_s = 0.02 * k;
      const Numbers steer{-std::remainder(2. * t_s, kTurn), std::remainder(-t_s, kTurn)};
      const Numbers rates{4. + 0.3 * 2., 5. - 0.2 * -1.};
      EncoderReading out =
          reading_of(t_s, is_angle ? Numbers{rates[0] * t_s, rates[1] * t_s} : rates, steer);
      const char* const why = map.convert(out);
      if (!is_angle && k == 0) {
        EXPECT_THAT(why, HasSubstr("how fast wheels were steered"));
        continue;
      }
      ASSERT_EQ(why, nullptr);
      if (!is_angle) {
        ASSERT_NEAR(out.drive[0], 4., 1e-9) << k;
        ASSERT_NEAR(out.drive[1], 5., 1e-9) << k;
      } else if (k > 0) {
        ASSERT_NEAR(out.drive[0] - last.drive[0], 0.08, 1e-9) << k;
        ASSERT_NEAR(out.drive[1] - last.drive[1], 0.1, 1e-9) << k;
      }
      EXPECT_NEAR(std::remainder(out.steer_rad[0] - 2. * t_s, kTurn), 0., 1e-9);
      last = out;
    }
    EncoderReading behind_gap = reading_of(10., {4., 5.}, {0., 0.});
    EXPECT_EQ(map.convert(behind_gap) == nullptr, is_angle);
    EXPECT_TRUE(behind_gap.is_start);
  }
}

TEST(Joints, ThatAreMountedWronglyInASimulatorAreRightAfterTheInverse) {
  std::vector<EncoderSample> samples(50);
  std::mt19937_64 rng(3);
  std::normal_distribution<double> normal;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    EncoderSample& sample = samples[k];
    sample.t_ns = static_cast<std::int64_t>(k) * 10'000'000;
    sample.n_drive = sample.n_steer = 4;
    for (std::size_t i = 0; i < 4; ++i) {
      sample.drive_rad_per_s[i] = normal(rng);
      sample.steer_rad[i] = 0.1 * normal(rng);
    }
  }
  const std::vector<EncoderSample> truth = samples;
  JointParams wrong, inverse;
  wrong.drive_scale = {-1., 6.75, 57.29578, 4.};
  wrong.drive_channel = {2., 3., 1., 4.};
  wrong.steer_scale = {57.29578, -1., 1., 2.};
  wrong.steer_shift_rad = {100., 2., -3., 0.5};
  wrong.steer_channel = {1., 2., 4., 3.};
  wrong.drive_per_steer = {-0.1, -0.2, -0.3, -0.4};
  inverse.drive_scale = {1. / 57.29578, -1., 1. / 6.75, 0.25};
  inverse.drive_channel = {3., 1., 2., 4.};
  std::vector<RejectionCount> rejections;
  // Coupling is in the units of the wheels: its inverse is found with scales and places left alone.
  JointParams coupled, uncoupled;
  coupled.drive_per_steer = wrong.drive_per_steer;
  uncoupled.drive_per_steer = {0.1, 0.2, 0.3, 0.4};
  wrong.drive_per_steer.clear();
  inverse.steer_scale = {1. / 57.29578, -1., 0.5, 1.};
  inverse.steer_shift_rad = {-100. / 57.29578, 2., -0.25, 3.};
  inverse.steer_channel = wrong.steer_channel;
  for (const auto& [there, back] : {std::pair{wrong, inverse}, std::pair{coupled, uncoupled}}) {
    samples = truth;
    mount_joints(there, samples, rejections);
    EXPECT_GT(std::abs(samples[9].drive_rad_per_s[0] - truth[9].drive_rad_per_s[0]), 1e-3);
    mount_joints(back, samples, rejections);
    const std::size_t left_out = truth.size() - samples.size();
    EXPECT_EQ(left_out, there.drive_per_steer.empty() ? 0U : 2U);
    for (std::size_t k = 0; k < samples.size(); ++k) {
      for (std::size_t i = 0; i < 4; ++i) {
        const EncoderSample& as_it_was = truth[k + left_out];
        EXPECT_EQ(samples[k].t_ns, as_it_was.t_ns);
        EXPECT_NEAR(samples[k].drive_rad_per_s[i], as_it_was.drive_rad_per_s[i], 1e-12);
        EXPECT_NEAR(samples[k].steer_rad[i], as_it_was.steer_rad[i], 1e-12);
      }
    }
  }
  ASSERT_EQ(rejections.size(), 2U) << "the first one there, and the first one back";
  EXPECT_EQ(rejections[0].count, 1);
  EXPECT_EQ(rejections[0].first, "stamp 0 ns");
}

}  // namespace
}  // namespace viwo::log
