// Faults of sensors, told from their samples alone: the samples of a simulated swerve robot, half a
// minute of them, with one thing done to all or some of them.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sensors_in_memory.hpp"
#include "simulated.hpp"
#include "viwo/plausibility/plausibility.hpp"
#include "viwo/setup/configuration.hpp"

namespace viwo {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// What is done to the samples of each sensor.
struct Fault {
  std::function<void(ImuSample&)> imu = [](ImuSample&) {};
  std::function<void(EncoderSample&)> wheels = [](EncoderSample&) {};
  std::function<void(FeatureSample&)> images = [](FeatureSample&) {};
};

RunSetup robot(const std::string& configuration, const std::vector<std::string>& more = {},
               std::uint64_t seed = 1) {
  std::vector<std::string> assignments = {"sensors.simulator0.duration_s=30",
                                          "estimator.calibration_error_scale=0"};
  assignments.insert(assignments.end(), more.begin(), more.end());
  const config::Node run = resolve_placeholders(load_run_configuration(
      testing::configuration("runs/" + configuration + ".yaml"), assignments));
  return read_run(run, testing::registry(), seed);
}

/// The texts of what is found in samples with a fault.
std::vector<std::string> found(RunSetup setup, const Fault& fault) {
  static std::map<std::string, std::vector<Measurement>> known;
  std::vector<Measurement>& samples = known[setup.name];
  if (samples.empty()) samples = testing::in_time_order(collect(setup).recorded);
  const auto sensor = [](const SampleType& type) {
    return std::make_shared<testing::InMemory>(SampleTypes{&type}, std::vector<Measurement>{});
  };
  testing::set_sensors(setup, {{"imu0", sensor(sample_type<ImuSample>())},
                               {"wheels0", sensor(sample_type<EncoderSample>())},
                               {"images0", sensor(sample_type<FeatureSample>())}});
  Plausibility plausibility(setup);
  for (const Measurement& sample : samples) {
    if (const auto* imu = sample.get_if<ImuSample>()) {
      ImuSample changed = *imu;
      fault.imu(changed);
      plausibility.add("imu0", changed);
    } else if (const auto* wheels = sample.get_if<EncoderSample>()) {
      EncoderSample changed = *wheels;
      fault.wheels(changed);
      plausibility.add("wheels0", changed);
    } else if (const auto* images = sample.get_if<FeatureSample>()) {
      FeatureSample changed = *images;
      fault.images(changed);
      plausibility.add("images0", changed);
    }
  }
  plausibility.finish();
  std::vector<std::string> texts;
  for (const Finding& finding : plausibility.findings()) texts.push_back(finding.text);
  return texts;
}

std::vector<std::string> found(const Fault& fault) { return found(robot("viwo_swerve"), fault); }

void scale(std::array<double, 3>& values, double factor) {
  for (double& value : values) value *= factor;
}

void scale_drives(EncoderSample& wheels, double factor) {
  for (double& rate : wheels.drive_rad_per_s) rate *= factor;
}

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

TEST(Plausibility, NamesDrivesThatAreAllReversed) {
  EXPECT_THAT(found({.wheels = [](EncoderSample& s) { scale_drives(s, -1.); }}),
              ElementsAre("wheels0: drives turn and accelerate opposite to the IMU: sign of all "
                          "drives"));
}

TEST(Plausibility, NamesTheLeftAndTheRightOfASkidSteerThatAreExchanged) {
  EXPECT_THAT(
      found(robot("viwo_skid_steer"),
            {.wheels =
                 [](EncoderSample& s) { std::swap(s.drive_rad_per_s[0], s.drive_rad_per_s[1]); }}),
      ElementsAre("wheels0: turn opposite to the IMU, and accelerate with it: drives on the left "
                  "and on the right are exchanged"));
}

TEST(Plausibility, NamesDrivesInOtherUnits) {
  EXPECT_THAT(
      found({.wheels = [](EncoderSample& s) { scale_drives(s, 30. / std::numbers::pi); }}),
      ElementsAre("wheels0: turn 9.55 times as fast as the gyro: drives are in revolutions per "
                  "minute"));
  EXPECT_THAT(found({.wheels = [](EncoderSample& s) { scale_drives(s, 180. / std::numbers::pi); }}),
              ElementsAre("wheels0: turn 57.3 times as fast as the gyro: drives are in deg/s"));
  EXPECT_THAT(
      found({.wheels = [](EncoderSample& s) { scale_drives(s, 0.5 / std::numbers::pi); }}),
      ElementsAre("wheels0: turn 0.159 times as fast as the gyro: drives are in revolutions per "
                  "second"));
}

TEST(Plausibility, NamesAScaleThatIsOffWithoutACause) {
  EXPECT_THAT(found({.wheels = [](EncoderSample& s) { scale_drives(s, 2.); }}),
              ElementsAre("imu0: the gyro turns 0.5 times as fast as the wheels (correlation "
                          "1): unit or scale of the drives, radii and track of the kinematics, "
                          "or scale of the gyro"));
  // Where radii are hardly known that is no contradiction.
  const RunSetup hardly_known = robot("viwo_swerve", {"kinematics.prior_sigma_radius_m=0.01"});
  EXPECT_THAT(found(hardly_known, {.wheels = [](EncoderSample& s) { scale_drives(s, 2.); }}),
              IsEmpty());
}

TEST(Plausibility, NamesOneDriveThatIsReversed) {
  EXPECT_THAT(
      found({.wheels = [](EncoderSample& s) { s.drive_rad_per_s[1] *= -1.; }}),
      ElementsAre("wheels0: drive_2 turns opposite to what the other wheels say: its sign"));
}

TEST(Plausibility, NamesTwoDrivesThatAreExchanged) {
  EXPECT_THAT(
      found({.wheels =
                 [](EncoderSample& s) { std::swap(s.drive_rad_per_s[0], s.drive_rad_per_s[2]); }}),
      ElementsAre("wheels0: drives contradict each other, and do not with drive_1 and "
                  "drive_3 exchanged: their order"));
}

TEST(Plausibility, NamesSteeringAnglesInDegrees) {
  EXPECT_THAT(found({.wheels =
                         [](EncoderSample& s) {
                           for (double& angle : s.steer_rad) angle *= 180. / std::numbers::pi;
                         }}),
              ElementsAre(::testing::MatchesRegex(
                  "wheels0: steering angles up to [0-9.]+ rad: they are in degrees")));
}

TEST(Plausibility, NamesSteeringAnglesThatAreReversed) {
  EXPECT_THAT(found({.wheels =
                         [](EncoderSample& s) {
                           for (double& angle : s.steer_rad) angle *= -1.;
                         }}),
              ElementsAre("wheels0: wheels contradict each other, and do not with all steering "
                          "angles reversed: their sign, or left and right of the wheels are "
                          "exchanged"));
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

TEST(Plausibility, NamesReadingsThatJump) {
  int i = 0;
  EXPECT_THAT(found({.imu =
                         [&i](ImuSample& s) {
                           if (++i % 50 == 0) s.accel_m_per_s2[0] += 50.;
                         }}),
              ElementsAre("imu0: the accelerometer's x jumps by 50 m/s^2 and back in 2 % of the "
                          "readings: a disturbed bus, or a loose cable"));
}

TEST(Plausibility, NamesTheLagOfTheWheels) {
  const auto late_by = [](std::int64_t late_ns, double shaken_rad_per_s) {
    return found({.imu =
                      [&](ImuSample& s) {
                        const double t_s = 1e-9 * static_cast<double>(s.t_ns);
                        s.gyro_rad_per_s[2] += shaken_rad_per_s * std::sin(50. * t_s);
                      },
                  .wheels =
                      [&](EncoderSample& s) {
                        for (std::int64_t* t_ns : {&s.t_ns, &s.begin_ns, &s.end_ns}) {
                          *t_ns += late_ns;
                        }
                      }});
  };
  EXPECT_THAT(late_by(100'000'000, 0.),
              ElementsAre(::testing::MatchesRegex(
                  "wheels0: lags behind imu0 by (9[0-9]|10[0-9]) ms, beside the 5 ms of t_OtoI_s "
                  "\\(\\+- 10 ms\\) - wheels\\.t_OtoI_s: -0\\.(09[0-9]*|08[0-9]|1[0-9]*)")));
  // So late that the two rates are hardly alike, on a base that shakes.
  EXPECT_THAT(late_by(400'000'000, 0.1),
              ElementsAre(::testing::MatchesRegex(
                  "wheels0: lags behind imu0 by (39[0-9]|40[0-9]) ms, beside the 5 ms of "
                  "t_OtoI_s \\(\\+- 10 ms\\) - wheels\\.t_OtoI_s: -0\\.(39[0-9]*|4)")));
}

/// Two wheels cannot contradict each other.
TEST(Plausibility, NamesADriveThatOnlyTheGyroKnowsIsReversed) {
  const auto found_with = [](double left, double right) {
    return found(robot("viwo_skid_steer"), {.wheels = [=](EncoderSample& wheels) {
                   wheels.drive_rad_per_s[0] *= left;
                   wheels.drive_rad_per_s[1] *= right;
                 }});
  };
  EXPECT_THAT(found_with(1., -1.), ElementsAre(AllOf(HasSubstr("drive_2 turns opposite"),
                                                     HasSubstr("variance of the gyro's rate"))));
  EXPECT_THAT(found_with(-1., 1.), ElementsAre(HasSubstr("drive_1 turns opposite")));
  // That may be the gyro's sign as well.
  EXPECT_THAT(found_with(-1., -1.), ElementsAre(HasSubstr("sign of all drives")));
}

TEST(Plausibility, NamesStampsOfAnotherUnit) {
  const auto found_with = [](std::int64_t times) {
    return found({.wheels = [times](EncoderSample& wheels) {
      wheels.t_ns *= times;
      wheels.begin_ns *= times;
      wheels.end_ns *= times;
    }});
  };
  EXPECT_THAT(found_with(1000),
              Contains(HasSubstr("wheels0: a sample every 10 s: its stamps are of another unit")));
}

TEST(Plausibility, NamesNoLagOfAClockThatWasSetOnTheWay) {
  const auto set_by = [](std::int64_t step_ns) {
    return found({.imu = [step_ns](ImuSample& s) {
      if (s.t_ns > 15'000'000'000) s.t_ns += step_ns;
    }});
  };
  EXPECT_THAT(set_by(-1'000'000'000), IsEmpty());
  EXPECT_THAT(set_by(1'000'000'000),
              ElementsAre("imu0: no samples for 1 s from t = 15.000 s: look at its cable, driver, "
                          "bus and clock, or at what has recorded it"));
}

TEST(Plausibility, NamesTheSensorWhoseClockIsAnother) {
  constexpr std::int64_t kYearsNs = 1'700'000'000'000'000'000;
  const auto later = [](auto& sample) {
    sample.t_ns += kYearsNs;
    if constexpr (requires { sample.begin_ns; }) {
      sample.begin_ns += kYearsNs;
      sample.end_ns += kYearsNs;
    }
  };
  const std::string cause =
      " those of the IMU: of another clock, or of another recording - none of its samples can be "
      "used";
  EXPECT_THAT(found({.wheels = later}),
              ElementsAre("wheels0: its stamps are 1.7e+09 s ahead of" + cause));
  EXPECT_THAT(found({.images = later}),
              ElementsAre("images0: its stamps are 1.7e+09 s ahead of" + cause));
  EXPECT_THAT(found({.imu = later}),
              ::testing::IsSupersetOf({"wheels0: its stamps are 1.7e+09 s behind" + cause,
                                       "images0: its stamps are 1.7e+09 s behind" + cause}));
}

TEST(Plausibility, NamesStampsThatAreNotInNanoseconds) {
  EXPECT_THAT(
      found({.imu = [](ImuSample& s) { s.t_ns /= 1000; }}),
      ::testing::Contains(HasSubstr("imu0: a sample every 5e-06 s: its stamps are of another "
                                    "unit")));
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
