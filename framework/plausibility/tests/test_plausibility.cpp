// Faults of sensors, told from their samples alone: nothing where there is none, the IMU, cameras,
// channels that are stuck, and what is said while a run goes on.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "faulty_samples.hpp"

namespace viwo {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using testing::Fault;
using testing::found;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::robot;
using testing::scale;

TEST(Plausibility, FindsNothingInSamplesWithoutAFault) {
  for (const char* name : {"viwo_swerve", "viwo_skid_steer", "viwo_ackermann", "viwo_mecanum"}) {
    EXPECT_THAT(found(robot(name), {}), IsEmpty()) << name;
  }
}

TEST(Plausibility, FindsNothingWhereTheStartOfTheCalibrationIsWrongAsFarAsItsPriorSays) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const RunSetup wrong = robot("viwo_swerve", {"estimator.calibration_error_scale=1"}, seed);
    EXPECT_THAT(found(wrong, Fault{}), IsEmpty()) << seed;
  }
}

TEST(Plausibility, FindsNothingWhereTheRobotIsOtherwiseAsFarAsItsPriorSays) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    RunSetup other =
        robot("viwo_swerve",
              {"sensors.simulator0.duration_s=12", "sensors.simulator0.true_intrinsics_scale=1",
               "sensors.simulator0.true_sigma_p_IinO_m=[0.1, 0.1, 0.1]",
               "sensors.simulator0.true_sigma_R_ItoO_rad=[0.01, 0.01, 0.01]",
               "sensors.simulator0.true_sigma_t_OtoI_s=0.01"},
              seed);
    other.name += " " + std::to_string(seed);
    EXPECT_THAT(found(other, Fault{}), IsEmpty()) << seed;
  }
}

TEST(Plausibility, NamesAnAccelerometerInG) {
  EXPECT_THAT(found({.imu = [](ImuSample& s) { scale(s.accel_m_per_s2, 1. / 9.80665); }}),
              ElementsAre(::testing::MatchesRegex(
                  "imu0: the accelerometer reads (0\\.99|1|1\\.0)[0-9]* m/s\\^2 \\(median\\) where "
                  "gravity is 9\\.81: it is in g \\(multiply by 9\\.80665\\)")));
}

TEST(Plausibility, NamesAnAccelerometerWithoutGravity) {
  EXPECT_THAT(found({.imu = [](ImuSample& s) { s.accel_m_per_s2[2] -= 9.81; }}),
              ElementsAre(::testing::EndsWith(
                  "where gravity is 9.81: its driver has taken gravity out (choose the raw "
                  "readings)")));
}

TEST(Plausibility, NamesAnAccelerometerOfAnotherScale) {
  EXPECT_THAT(
      found({.imu = [](ImuSample& s) { scale(s.accel_m_per_s2, 1.2); }}),
      ElementsAre(::testing::EndsWith("where gravity is 9.81: check its unit and scale, and "
                                      "estimator.gravity_m_per_s2")));
}

TEST(Plausibility, NamesAGyroInDegrees) {
  EXPECT_THAT(
      found({.imu = [](ImuSample& s) { scale(s.gyro_rad_per_s, 180. / std::numbers::pi); }}),
      ElementsAre("imu0: the gyro turns 57.3 times as fast as the wheels: it is in deg/s"));
}

// Drives in deg/s would turn as many times as fast, and accelerate so, too.
TEST(Plausibility, NamesAGyroThatIsInRadiansAlready) {
  EXPECT_THAT(found({.imu = [](ImuSample& s) { scale(s.gyro_rad_per_s, M_PI / 180.); }}),
              ElementsAre(AllOf(HasSubstr("imu0: turns 0.0175 times as fast as the wheels"),
                                HasSubstr("its gyro is in rad/s, not in deg/s"))));
}

TEST(Plausibility, NamesAnAxisThatIsNotRead) {
  const char* const text = "all the time, while the other axes change: it is not read";
  EXPECT_THAT(found({.imu = [](ImuSample& s) { s.accel_m_per_s2[0] = 0.; }}),
              Contains(AllOf(HasSubstr("accelerometer's x"), HasSubstr(text))));
  EXPECT_THAT(found({.imu = [](ImuSample& s) { s.gyro_rad_per_s[2] = 0.; }}),
              Contains(AllOf(HasSubstr("gyro's z"), HasSubstr(text))));
  // A gyro about z alone has no other axes.
  EXPECT_THAT(found({.imu = [](ImuSample& s) { s.gyro_rad_per_s[0] = s.gyro_rad_per_s[1] = 0.; }}),
              ::testing::Not(Contains(HasSubstr(text))));
}

TEST(Plausibility, NamesAnImuThatIsMountedUpsideDown) {
  EXPECT_THAT(found({.imu =
                         [](ImuSample& s) {
                           for (std::size_t i = 1; i < 3; ++i) {
                             s.gyro_rad_per_s[i] *= -1.;
                             s.accel_m_per_s2[i] *= -1.;
                           }
                         }}),
              ElementsAre("imu0: gravity is on -z where wheels.rpy_ItoO_rad puts it on +z: the IMU "
                          "is mounted upside down, or its axes are exchanged"));
}

TEST(Plausibility, NamesAnAccelerometerThatReadsDownwards) {
  EXPECT_THAT(
      found({.imu = [](ImuSample& s) { scale(s.accel_m_per_s2, -1.); }}),
      ElementsAre("imu0: gravity is on -z where wheels.rpy_ItoO_rad puts it on +z: the gyro "
                  "turns as the wheels do: sign of the accelerometer (at rest it reads "
                  "upwards)"));
}

TEST(Plausibility, NamesAnImuThatStandsUpright) {
  EXPECT_THAT(found({.imu =
                         [](ImuSample& s) {
                           std::swap(s.gyro_rad_per_s[0], s.gyro_rad_per_s[2]);
                           std::swap(s.accel_m_per_s2[0], s.accel_m_per_s2[2]);
                         }}),
              ElementsAre("imu0: gravity is on +x where wheels.rpy_ItoO_rad puts it on +z: the IMU "
                          "is mounted otherwise, its axes are exchanged or reversed"));
}

TEST(Plausibility, NamesExchangedAxesOfTheImu) {
  EXPECT_THAT(found({.imu =
                         [](ImuSample& s) {
                           std::swap(s.gyro_rad_per_s[0], s.gyro_rad_per_s[1]);
                           std::swap(s.accel_m_per_s2[0], s.accel_m_per_s2[1]);
                         }}),
              ElementsAre(::testing::MatchesRegex(
                  "imu0: in the base's frame x of the accelerometer follows y of the wheels "
                  "\\(correlation 0\\.[0-9]+\\), y follows x of the wheels \\(correlation "
                  "0\\.[0-9]+\\): axes exchanged; determinant -1: not a rotation")));
}

/// Along x it accelerates less than it does along y: both signs count alike.
TEST(Plausibility, NamesAnAxisOfTheAccelerometerThatIsReversed) {
  const std::array<std::string, 2> names = {"x", "y, or of the base's"};
  for (const std::size_t axis : {0u, 1u}) {
    EXPECT_THAT(found({.imu = [&](ImuSample& s) { s.accel_m_per_s2[axis] *= -1.; }}),
                ElementsAre(AllOf(HasSubstr("x of the accelerometer follows x of the wheels"),
                                  HasSubstr("y follows y of the wheels"),
                                  EndsWith("sign of the accelerometer's " + names[axis]))));
  }
}

TEST(Plausibility, NamesTheYawOfTheMounting) {
  // The IMU's x points to the left, as the base's y does.
  EXPECT_THAT(found({.imu =
                         [](ImuSample& s) {
                           const auto [x, y, z] = s.accel_m_per_s2;
                           s.accel_m_per_s2 = {y, -x, z};
                         }}),
              ElementsAre(::testing::EndsWith(
                  "the IMU is turned: add 1.5708 to the yaw of wheels.rpy_ItoO_rad")));
}

TEST(Plausibility, NamesAGyroThatIsReversed) {
  EXPECT_THAT(found({.imu = [](ImuSample& s) { s.gyro_rad_per_s[2] *= -1.; }}),
              ElementsAre("imu0: the gyro turns opposite to the wheels, the accelerometer agrees "
                          "with them: sign of the gyro's z"));
}

TEST(Plausibility, NamesAnImuThatWasStuck) {
  ImuSample held;
  EXPECT_THAT(
      found({.imu =
                 [&held](ImuSample& s) {
                   const std::int64_t t_ns = s.t_ns;
                   if (t_ns > 15'000'000'000 && t_ns <= 17'000'000'000) s = held;
                   s.t_ns = t_ns;
                   held = s;
                 }}),
      ElementsAre(::testing::MatchesRegex(
          "imu0: the same six numbers 401 times from t = 15\\.[0-9]+ s on: it was stuck for 2 s")));
}

TEST(Plausibility, NamesAGyroThatIsSaturated) {
  EXPECT_THAT(found({.imu =
                         [](ImuSample& s) {
                           double& rate = s.gyro_rad_per_s[2];
                           rate = std::clamp(rate, -0.3, 0.3);
                         }}),
              ::testing::Contains(::testing::MatchesRegex(
                  "imu0: the gyro's z is at \\+-0\\.3 rad/s in [0-9]+ % of the readings: saturated "
                  "- choose a larger full scale range")));
}

TEST(Plausibility, TakesNoCoarseGyroForOneThatIsSaturated) {
  EXPECT_THAT(found({.imu =
                         [](ImuSample& s) {
                           double& rate = s.gyro_rad_per_s[2];
                           rate = 0.02 * std::round(rate / 0.02);
                         }}),
              ElementsAre());
}

TEST(Plausibility, TakesNoCoarseAccelerometerForOneThatIsSaturated) {
  // Gravity is 126 of its steps, and noise reaches two or three of them.
  EXPECT_THAT(found({.imu =
                         [](ImuSample& s) {
                           double& force = s.accel_m_per_s2[2];
                           constexpr double kStep = 0.0766;
                           force = kStep * std::round((9.81 + 0.02 * (force - 9.81)) / kStep);
                         }}),
              Not(Contains(HasSubstr("saturated"))));
}

TEST(Plausibility, NamesReadingsThatJump) {
  int i = 0;
  EXPECT_THAT(found({.imu =
                         [&i](ImuSample& s) {
                           if (++i % 50 == 0) s.accel_m_per_s2[0] += 50.;
                         }}),
              ElementsAre("imu0: the accelerometer's x jumps by 50 m/s^2 and back in 2 % of the "
                          "readings: a disturbed bus, or a loose cable"));
}

TEST(Plausibility, NamesCamerasThatAreSwapped) {
  EXPECT_THAT(found({.images = [](FeatureSample& s) { s.camera = 1 - s.camera; }}),
              ElementsAre(::testing::MatchesRegex(
                  "images0: points seen by cam0 and cam1 lie behind both \\([0-9]+ %\\): the two "
                  "cameras are swapped, or both images upside down")));
}

TEST(Plausibility, SaysWhatItFindsWhileTheRunGoesOn) {
  std::vector<std::string> told;
  RunSetup setup = robot("viwo_swerve");
  RunData data = collect(setup);
  setup.filter->options.filter.gravity_m_per_s2 = 8.;
  RunHooks hooks;
  hooks.on_warning = [&](double, const std::string& text) { told.push_back(text); };
  const RunResult result = run_filter(setup, data, hooks);
  const auto begins = ::testing::StartsWith("imu of simulator0: the accelerometer reads 9.8");
  EXPECT_THAT(told, ::testing::Contains(begins).Times(1));
  EXPECT_THAT(result.warnings, ::testing::Contains(begins).Times(1));
}

TEST(Plausibility, FindsAChannelThatIsStuckWhileTheOthersGoOn) {
  std::int64_t begin_ns = 0;
  const auto is_late = [&begin_ns](std::int64_t t_ns) {
    if (begin_ns == 0) begin_ns = t_ns;
    return t_ns - begin_ns > 20'000'000'000;
  };
  Fault fault;
  fault.imu = [&is_late](ImuSample& imu) {
    if (is_late(imu.t_ns)) imu.gyro_rad_per_s[2] = 0.;
  };
  EXPECT_THAT(found(fault), Contains(AllOf(HasSubstr("the gyro's z reads 0 rad/s all the time"),
                                           HasSubstr("it was stuck"))));
  // Every other reading of a coarse sensor may well repeat the one before.
  fault.imu = [](ImuSample& imu) {
    for (double& rate : imu.gyro_rad_per_s) rate = 0.01 * std::round(rate / 0.01);
  };
  EXPECT_THAT(found(fault), Not(Contains(HasSubstr("stuck"))));
  fault.imu = [](ImuSample&) {};
  double held = 0.;
  fault.wheels = [&is_late, &held](EncoderSample& wheels) {
    if (is_late(wheels.t_ns) && held != 0.) wheels.drive_rad_per_s[1] = held;
    held = wheels.drive_rad_per_s[1];
  };
  EXPECT_THAT(found(fault), Contains(AllOf(HasSubstr("drive_2 reads "), HasSubstr("stuck"))));
}

}  // namespace
}  // namespace viwo
