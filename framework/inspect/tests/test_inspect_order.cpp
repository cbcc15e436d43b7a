// Signs, units, gears and order of the channels of encoders, put into simulated recordings.
#include <algorithm>
#include <numbers>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "inspected.hpp"

namespace viwo::inspect {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(InspectWheels, FindsTheSignOfADriveAndWritesIt) {
  const Inspection reversed =
      with_wheels(swerve(), [](EncoderSample& s) { s.drive_rad_per_s[1] *= -1.; });
  EXPECT_THAT(faults_of(reversed), ElementsAre("wheels0 order"));
  EXPECT_EQ(remedy_of(finding_of(reversed, "wheels0", "order"), "sensors.wheels0.drive_scale"),
            "[1, -1, 1, 1]");
}

// A wheel that points the other way rolls the other way: no motion tells the two apart.
TEST(InspectWheels, TakesASteeringThatIsOffByHalfATurnForAReversedDrive) {
  const Inspection turned =
      with_wheels(swerve(), [](EncoderSample& s) { s.steer_rad[2] += std::numbers::pi; });
  EXPECT_EQ(remedy_of(finding_of(turned, "wheels0", "order"), "sensors.wheels0.drive_scale"),
            "[1, 1, -1, 1]");
}

TEST(InspectWheels, FindsTheSignOfTheSteeringAndWritesIt) {
  const Inspection one = with_wheels(swerve(), [](EncoderSample& s) { s.steer_rad[3] *= -1.; });
  EXPECT_EQ(remedy_of(finding_of(one, "wheels0", "order"), "sensors.wheels0.steer_scale"),
            "[1, 1, 1, -1]");
  const Inspection all = with_wheels(swerve(), [](EncoderSample& s) {
    for (double& angle : s.steer_rad) angle *= -1.;
  });
  EXPECT_EQ(remedy_of(finding_of(all, "wheels0", "order"), "sensors.wheels0.steer_scale"),
            "[-1, -1, -1, -1]");
}

TEST(InspectWheels, FindsTheOrderAndWritesIt) {
  const Inspection drives = with_wheels(
      swerve(), [](EncoderSample& s) { std::swap(s.drive_rad_per_s[0], s.drive_rad_per_s[2]); });
  EXPECT_EQ(remedy_of(finding_of(drives, "wheels0", "order"), "sensors.wheels0.drive_channel"),
            "[3, 2, 1, 4]");
  const Inspection wheels = with_wheels(swerve(), [](EncoderSample& s) {
    std::swap(s.drive_rad_per_s[0], s.drive_rad_per_s[1]);
    std::swap(s.steer_rad[0], s.steer_rad[1]);
  });
  EXPECT_EQ(remedy_of(finding_of(wheels, "wheels0", "order"), "sensors.wheels0.steer_channel"),
            "[2, 1, 3, 4]");
}

// A base that is turned by half a turn has its wheels in another order, and turns the other way:
// the gyro says which of the two it is.
TEST(InspectWheels, FindsTheOrderOfThreeAndFourWheelsByTheGyro) {
  const auto read_as = [](std::array<std::size_t, 4> order) {
    return [order](EncoderSample& s) {
      const EncoderSample is = s;
      for (std::size_t i = 0; i < 4; ++i) {
        s.drive_rad_per_s[order[i]] = is.drive_rad_per_s[i];
        s.steer_rad[order[i]] = is.steer_rad[i];
      }
    };
  };
  const Inspection three = with_wheels(swerve(), read_as({1, 2, 0, 3}));
  EXPECT_THAT(faults_of(three), ElementsAre("wheels0 order"));
  const Finding order = finding_of(three, "wheels0", "order");
  EXPECT_THAT(order.what, HasSubstr("wheel 1 is what is read as wheel 2, wheel 2 wheel 3, "
                                    "wheel 3 wheel 1: their order"));
  EXPECT_EQ(remedy_of(order, "sensors.wheels0.drive_channel"), "[3, 1, 2, 4]");
  EXPECT_EQ(remedy_of(order, "sensors.wheels0.steer_channel"), "[3, 1, 2, 4]");
  const Inspection four = with_wheels(swerve(), read_as({1, 2, 3, 0}));
  EXPECT_EQ(remedy_of(finding_of(four, "wheels0", "order"), "sensors.wheels0.drive_channel"),
            "[4, 1, 2, 3]");
  const Inspection drives = with_wheels(swerve(), [](EncoderSample& s) {
    std::rotate(s.drive_rad_per_s.begin(), s.drive_rad_per_s.begin() + 1,
                s.drive_rad_per_s.begin() + 4);
  });
  EXPECT_EQ(remedy_of(finding_of(drives, "wheels0", "order"), "sensors.wheels0.drive_channel"),
            "[2, 3, 4, 1]");
}

TEST(InspectWheels, FindsSteeringInDegreesAndWritesTheScale) {
  const Inspection degrees = with_wheels(swerve(), [](EncoderSample& s) {
    for (double& angle : s.steer_rad) angle *= 180. / std::numbers::pi;
  });
  EXPECT_THAT(faults_of(degrees), ElementsAre("wheels0 steering"));
  EXPECT_THAT(remedy_of(finding_of(degrees, "wheels0", "steering"), "sensors.wheels0.steer_scale"),
              HasSubstr("[0.0174532925"));
}

// Never more than a turn, so that no angle by itself is impossible.
TEST(InspectWheels, FindsSmallSteeringAnglesInDegrees) {
  const Inspection degrees = with_wheels(swerve(), [](EncoderSample& s) {
    for (double& angle : s.steer_rad) {
      angle = std::remainder(angle * 180. / std::numbers::pi, 2. * std::numbers::pi);
    }
  });
  EXPECT_THAT(faults_of(degrees), ::testing::Not(IsEmpty()));
  const Inspection car = with_wheels(simulated("viwo_ackermann"), [](EncoderSample& s) {
    for (double& angle : s.steer_rad) angle *= 180. / std::numbers::pi;
  });
  EXPECT_THAT(faults_of(car), ::testing::Not(IsEmpty()));
}

TEST(InspectWheels, NamesBothOfTwoDrivesOfWhichOneIsReversedWhereNoGyroSpeaks) {
  const auto fault = [](EncoderSample& s) { s.drive_rad_per_s[1] *= -1.; };
  RunSetup without_filter = four_drives();
  without_filter.filter.reset();
  const Finding order =
      finding_of(by_poses_alone(std::move(without_filter), fault), "wheels0", "order");
  EXPECT_THAT(order.what, HasSubstr("drive_2 turns opposite"));
  EXPECT_THAT(order.what, HasSubstr("drive_4 turns opposite"));
  EXPECT_THAT(order.remedies, IsEmpty());
  const Inspection with_gyro = with_wheels(four_drives(), fault);
  EXPECT_THAT(faults_of(with_gyro), ElementsAre("wheels0 order"));
  EXPECT_EQ(remedy_of(finding_of(with_gyro, "wheels0", "order"), "sensors.wheels0.drive_scale"),
            "[1, -1, 1, 1]");
}

TEST(InspectWheels, FindsThatASideIsReversedByTheGyroAndByPoses) {
  const auto right = [](EncoderSample& s) {
    s.drive_rad_per_s[1] *= -1.;
    s.drive_rad_per_s[3] *= -1.;
  };
  const Inspection by_gyro = with_wheels(four_drives(), right);
  EXPECT_THAT(faults_of(by_gyro), ElementsAre("wheels0 order"));
  EXPECT_EQ(remedy_of(finding_of(by_gyro, "wheels0", "order"), "sensors.wheels0.drive_scale"),
            "[1, -1, 1, -1]");
  RunSetup planar = four_drives("straight");
  planar.filter.reset();
  const Inspection by_poses = inspected(std::move(planar), {.imu = [](ImuSample&) { return false; },
                                                            .wheels =
                                                                [&right](EncoderSample& s) {
                                                                  right(s);
                                                                  return true;
                                                                }});
  EXPECT_THAT(faults_of(by_poses), Contains("wheels0 order"));
  EXPECT_EQ(remedy_of(finding_of(by_poses, "wheels0", "order"), "sensors.wheels0.drive_scale"),
            "[1, -1, 1, -1]");
}

TEST(InspectWheels, FindsTheGearOfASideByTheGyroAndByPoses) {
  const auto left = [](EncoderSample& s) {
    s.drive_rad_per_s[0] *= 2.;
    s.drive_rad_per_s[2] *= 2.;
  };
  const Inspection by_gyro = with_wheels(four_drives(), left);
  EXPECT_THAT(faults_of(by_gyro), ElementsAre("wheels0 order"));
  const Finding order = finding_of(by_gyro, "wheels0", "order");
  EXPECT_THAT(order.what, HasSubstr("drive_1, drive_3, all of one side, turn 2 times as fast as"));
  EXPECT_EQ(remedy_of(order, "sensors.wheels0.drive_scale"), "[0.5, 1, 0.5, 1]");
  RunSetup planar = four_drives("straight");
  planar.filter.reset();
  const Fault fault = {.imu = [](ImuSample&) { return false; },
                       .wheels =
                           [&left](EncoderSample& s) {
                             left(s);
                             return true;
                           }};
  const Inspection by_poses = inspected(std::move(planar), fault);
  EXPECT_EQ(remedy_of(finding_of(by_poses, "wheels0", "order"), "sensors.wheels0.drive_scale"),
            "[0.5, 1, 0.5, 1]");
}

TEST(InspectWheels, FindsADriveOfTwoByPosesAlone) {
  const auto straight = [] { return two_drives({"placeholders.motion=straight"}); };
  EXPECT_THAT(faults_of(by_poses_alone(straight(), [](EncoderSample&) {})), IsEmpty());
  for (const auto& [scale, remedy] :
       {std::pair{-1., "[1, -1]"}, std::pair{2., "[1, 0.5]"}, std::pair{0.5, "[1, 2]"}}) {
    const Inspection found = by_poses_alone(
        straight(), [scale = scale](EncoderSample& s) { s.drive_rad_per_s[1] *= scale; });
    EXPECT_EQ(remedy_of(finding_of(found, "wheels0", "order"), "sensors.wheels0.drive_scale"),
              remedy)
        << scale;
  }
  // A radius that is half as large again is neither the one's gear nor the other's.
  const Inspection larger = by_poses_alone(straight(), [](EncoderSample& s) {
    for (double& rate : s.drive_rad_per_s) rate *= 1.5;
  });
  EXPECT_THAT(faults_of(larger), ElementsAre("wheels0 speed"));
}

TEST(InspectWheels, FindsTheSignOfADriveOfABaseThatCannotContradictItselfByTheGyro) {
  const Inspection reversed =
      with_wheels(simulated("viwo_skid_steer", {"sensors.simulator0.duration_s=30"}),
                  [](EncoderSample& s) { s.drive_rad_per_s[0] *= -1.; });
  EXPECT_THAT(faults_of(reversed), ElementsAre("wheels0 order"));
  EXPECT_EQ(remedy_of(finding_of(reversed, "wheels0", "order"), "sensors.wheels0.drive_scale"),
            "[-1, 1]");
}

}  // namespace
}  // namespace viwo::inspect
