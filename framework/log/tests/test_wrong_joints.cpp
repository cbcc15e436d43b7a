// Lists of joints that are wrong, readings that no joint makes; and that nothing is allocated.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "allocations.hpp"
#include "joint_readings.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/joints.hpp"

namespace viwo::log {
namespace {

using ::testing::HasSubstr;

TEST(Joints, SayWhichListIsWrong) {
  const auto error = [](const std::function<void(JointParams&)>& set, bool is_angle = false,
                        int n_steer = 3) {
    JointParams params;
    set(params);
    try {
      JointMap(params, 4, n_steer, is_angle, 0.2);
    } catch (const ParamError& refused) {
      return refused.key() + ": " + refused.what();
    }
    return std::string();
  };
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(error([](auto& p) {
              p.drive_scale = {1., 2., 3.};
            }),
            "drive_scale: has 3 numbers for 4 drive channels of the log: one for each, in their "
            "order");
  EXPECT_EQ(error([](auto& p) { p.steer_shift_rad = {1.}; }, false, 0),
            "steer_shift_rad: has 1 number for 0 steering channels of the log: one for each, in "
            "their order");
  EXPECT_EQ(error([](auto& p) {
              p.steer_scale = {1., 0., 3.};
            }),
            "steer_scale: number 2 is 0: nothing of the reading would be left");
  EXPECT_EQ(error([&](auto& p) {
              p.drive_scale = {1., 2., 3., infinite};
            }),
            "drive_scale: number 4 is not finite");
  EXPECT_EQ(error([](auto& p) {
              p.drive_turn = {0., 0., 6.3, 0.};
            }),
            "drive_turn: rates never begin anew: this is for drives that are angles");
  EXPECT_EQ(error([](auto& p) { p.drive_turn = {0., 0., 6.3, 0.}; }, true), "");
  EXPECT_EQ(error([](auto& p) {
              p.drive_channel = {1., 2., 5., 0.};
            }),
            "drive_channel: number 3 must be a channel from 1 to 4, or 0");
  EXPECT_EQ(error([](auto& p) {
              p.drive_channel = {1., 1.5, 2., 0.};
            }),
            "drive_channel: number 2 must be a channel from 1 to 4, or 0");
  EXPECT_EQ(error([](auto& p) {
              p.drive_channel = {1., 3., 1., 3.};
            }),
            "drive_channel: names channel 3, and none is channel 2");
  EXPECT_EQ(error([](auto& p) {
              p.drive_channel = {0., 0., 0., 0.};
            }),
            "drive_channel: leaves all drives out");
  EXPECT_EQ(error([](auto& p) {
              p.steer_channel = {1., 2., 2.};
            }),
            "steer_channel: names channel 2 twice: there is no mean of steering angles");
  EXPECT_EQ(error([](auto& p) {
              p.drive_per_steer = {1., 2., 2., 1.};
            }),
            "drive_per_steer: has 4 numbers for wheels with 4 drives and 3 steering angles: one of "
            "each for every wheel");
  EXPECT_EQ(error(
                [](auto& p) {
                  p.drive_per_steer = {1., 2., 2., std::nan("")};
                },
                false, 4),
            "drive_per_steer: number 4 is not finite");
}

TEST(Joints, ThatScaleAReadingBeyondAllNumbersAreRejected) {
  JointParams params;
  params.drive_scale = {1e10};
  JointMap map(params, 1, 0, false, 0.2);
  EncoderReading reading = reading_of(0., {1e300});
  EXPECT_THAT(map.convert(reading), HasSubstr("where it is scaled (drive_scale, steer_scale)"));
}

TEST(Joints, ThatTurnFasterThanAnyDriveAreRejected) {
  for (const double scale : {1., -2.}) {  // 1 leaves the lists out
    JointParams params;
    if (scale != 1.) params.drive_scale = {1., scale};
    JointMap map(params, 2, 0, false, 0.2);
    for (const double rate : {1e100, -2e4, 1.001e4}) {
      EncoderReading reading = reading_of(0., {0., rate});
      EXPECT_STREQ(map.convert(reading), "drive faster than 1e4 rad/s") << scale << " " << rate;
    }
    converted(map, reading_of(1., {9999., 4999.}));
  }
}

TEST(Joints, ThatAreSteeredFurtherThanAnyWheelAreRejected) {
  for (const double scale : {1., -2.}) {  // 1 leaves the lists out
    JointParams params;
    if (scale != 1.) params.steer_scale = {1., scale};
    JointMap map(params, 1, 2, false, 0.2);
    converted(map, reading_of(0., {0.}, {0., 4e5}));
    for (const double angle : {1e18, -1e300, 1.001e6}) {
      EncoderReading reading = reading_of(0.1, {0.}, {0., angle});
      EXPECT_STREQ(map.convert(reading), "steering beyond 1e6 rad") << scale << " " << angle;
    }
    converted(map, reading_of(0.2, {0.}, {0., -4e5}));
  }
}

TEST(Joints, WhoseAnglesJumpAreRejectedAndStartAnewAfterIt) {
  JointMap map({}, 1, 0, true, 0.2);
  std::vector<EncoderReading> used;
  int rejected = 0;
  for (int k = 0; k < 40; ++k) {
    // One reading is broken, and the counter is set back.
    const double angle = k == 10 ? 1e100 : k < 20 ? 5e4 + 0.2 * k : 0.2 * k;
    EncoderReading reading = reading_of(0.02 * k, {angle});
    const char* const why = map.convert(reading);
    if (why == nullptr) {
      used.push_back(reading);
      continue;
    }
    EXPECT_STREQ(why, "drive faster than 1e4 rad/s");
    ++rejected;
  }
  EXPECT_EQ(rejected, 2);
  const auto cells = samples_from(used, true, 0.2, 1);
  EXPECT_EQ(cells.size(), 35U);
  for (const EncoderSample& cell : cells) EXPECT_NEAR(cell.drive_rad_per_s[0], 10., 1e-6);
}

TEST(Joints, MayHaveAnglesWhoseStampsBunch) {
  JointMap map({}, 1, 0, true, 0.2);
  converted(map, reading_of(0., {0.}));
  EXPECT_FALSE(converted(map, reading_of(1e-6, {0.2})).is_start);
}

TEST(Joints, AllocateNothing) {
  if (!testing::counts_allocations()) GTEST_SKIP() << "malloc belongs to the sanitizer";
  JointParams params;
  params.drive_scale = {-1., 1., 1., 1.};
  params.drive_turn = {1., 1., 1., 1.};
  params.drive_channel = {2., 1., 3., 4.};
  params.steer_turn = {1., 1., 1., 1.};
  params.drive_per_steer = {1., 2., 3., 4.};
  JointMap map(params, 4, 4, true, 0.2);
  const EncoderReading reading = reading_of(0., {0., 0., 0., 0.}, {0., 0., 0., 0.});
  const long before = testing::allocations();
  for (std::size_t k = 0; k < 100; ++k) {
    EncoderReading next = reading;
    next.t_ns = static_cast<std::int64_t>(k) * 10'000'000;
    next.drive[k % 4] = k % 7 == 0 ? 0.5 : 0.;  // some are rejected
    next.steer_rad[k % 3] = k % 11 == 0 ? 0.5 : 0.;
    map.convert(next);
  }
  EXPECT_EQ(testing::allocations() - before, 0);
}

}  // namespace
}  // namespace viwo::log
