// Recordings of a configuration without a filter: wheels with an IMU whose mounting is not said, or
// with a gyro that integrates for itself.
#include <numbers>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "inspected.hpp"
#include "viwo/config/overrides.hpp"

namespace viwo::inspect {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kDegree = std::numbers::pi / 180.;

RunSetup without_filter(const std::string& name, const std::vector<std::string>& more = {}) {
  std::vector<std::string> assignments = {"sensors.simulator0.duration_s=40"};
  assignments.insert(assignments.end(), more.begin(), more.end());
  RunSetup setup = simulated(name, assignments);
  setup.filter.reset();
  return setup;
}

Inspection with_imu(const std::function<void(ImuSample&)>& fault) {
  return inspected(without_filter("viwo_skid_steer"), {.imu = [&fault](ImuSample& s) {
                     fault(s);
                     return true;
                   }});
}

TEST(InspectWithoutFilter, LooksAtTheImuAndSaysWhatItCannotLookAt) {
  const Inspection clean = with_imu([](ImuSample&) {});
  EXPECT_THAT(faults_of(clean), IsEmpty());
  EXPECT_THAT(finding_of(clean, "imu0", "noise").what, HasSubstr("noises not looked at"));
  EXPECT_THAT(faults_of(with_imu([](ImuSample& s) {
                for (double& rate : s.gyro_rad_per_s) rate /= kDegree;
              })),
              ElementsAre("imu0 rate"));
  EXPECT_THAT(faults_of(with_imu([](ImuSample& s) { s.gyro_rad_per_s[2] = 0.; })),
              Contains("imu0 channel"));
  EXPECT_THAT(faults_of(with_imu([](ImuSample& s) {
                for (double& force : s.accel_m_per_s2) force /= 9.80665;
              })),
              ElementsAre("imu0 gravity"));
  EXPECT_THAT(faults_of(with_imu([](ImuSample& s) { s.accel_m_per_s2[2] -= 9.81; })),
              ElementsAre("imu0 gravity"));
  const Finding huge = finding_of(with_imu([](ImuSample& s) {
                                    s.accel_m_per_s2[2] = 1e30 * (1. + 1e-3 * s.gyro_rad_per_s[0]);
                                  }),
                                  "imu0", "gravity");
  EXPECT_THAT(huge.what, ::testing::Not(HasSubstr("mg")));
}

TEST(InspectWithoutFilter, TakesTheAxisOfTheImuFromGravity) {
  EXPECT_THAT(faults_of(with_imu([](ImuSample& s) {
                s.gyro_rad_per_s = {s.gyro_rad_per_s[2], s.gyro_rad_per_s[1], -s.gyro_rad_per_s[0]};
                s.accel_m_per_s2 = {s.accel_m_per_s2[2], s.accel_m_per_s2[1], -s.accel_m_per_s2[0]};
              })),
              IsEmpty());
}

/// Nobody can say whether the sign of a gyro is wrong, or two drives are exchanged.
TEST(InspectWithoutFilter, NamesAllThatTurnsTheRateRound) {
  const Inspection reversed = with_imu([](ImuSample& s) { s.gyro_rad_per_s[2] *= -1.; });
  EXPECT_THAT(faults_of(reversed), ElementsAre("imu0 rate"));
  EXPECT_THAT(finding_of(reversed, "imu0", "rate").what,
              HasSubstr("sign of the gyro's z, of the accelerometer (at rest it reads upwards), "
                        "sign of all drives, or drives on the left and on the right exchanged"));
}

/// The IMU becomes a gyro of the yaw.
Inspection with_heading(const std::string& name, const std::function<void(HeadingSample&)>& fault) {
  RunSetup setup = without_filter(name);
  std::vector<Measurement> wheels, headings;
  for (Measurement m; setup.sensors.front().sensor.object->next(m) == Status::kOk;) {
    if (m.get_if<EncoderSample>() != nullptr) wheels.push_back(m);
    if (const auto* state = m.get_if<StateSample>()) {
      const auto& q = state->q_ItoG_xyzw;
      HeadingSample heading{state->t_ns, std::atan2(2. * (q[3] * q[2] + q[0] * q[1]),
                                                    1. - 2. * (q[1] * q[1] + q[2] * q[2]))};
      fault(heading);
      headings.emplace_back(heading);
    }
  }
  testing::set_sensors(setup,
                       {{"headings0", std::make_shared<testing::InMemory>(
                                          SampleTypes{&sample_type<HeadingSample>()}, headings)},
                        {"wheels0", std::make_shared<testing::InMemory>(
                                        SampleTypes{&sample_type<EncoderSample>()}, wheels)}});
  return inspect(setup);
}

TEST(InspectHeadings, FitsWhereTheWheelsTurnAlike) {
  for (const char* name : {"viwo_skid_steer", "viwo_swerve"}) {
    const Inspection clean = with_heading(name, [](HeadingSample&) {});
    EXPECT_THAT(faults_of(clean), IsEmpty()) << name;
    EXPECT_EQ(finding_of(clean, "headings0", "turns").severity, Severity::kFits) << name;
  }
}

TEST(InspectHeadings, TellsTheirUnit) {
  const Inspection degrees =
      with_heading("viwo_swerve", [](HeadingSample& s) { s.yaw_rad /= kDegree; });
  EXPECT_THAT(faults_of(degrees), ElementsAre("headings0 rate"));
  EXPECT_THAT(finding_of(degrees, "headings0", "rate").what, HasSubstr("it is in degrees"));
}

TEST(InspectHeadings, TellsThatTheyAreStuck) {
  const Inspection stuck = with_heading("viwo_swerve", [](HeadingSample& s) { s.yaw_rad = 1.5; });
  EXPECT_THAT(faults_of(stuck), ElementsAre("headings0 rate"));
  EXPECT_THAT(finding_of(stuck, "headings0", "rate").what, HasSubstr("it is stuck"));
}

TEST(InspectHeadings, TellsThatSomebodySetThemToZero) {
  const Inspection zeroed = with_heading("viwo_swerve", [](HeadingSample& s) {
    if (s.t_ns > 10'000'000'000) s.yaw_rad -= 2.5;
  });
  EXPECT_THAT(faults_of(zeroed), IsEmpty());
  EXPECT_THAT(finding_of(zeroed, "headings0", "jumps").what, HasSubstr("it jumps by -14"));
}

TEST(InspectHeadings, TellsTheirSignAndWhatLooksTheSame) {
  const Inspection reversed =
      with_heading("viwo_swerve", [](HeadingSample& s) { s.yaw_rad *= -1.; });
  EXPECT_THAT(faults_of(reversed), ElementsAre("headings0 rate"));
  EXPECT_THAT(finding_of(reversed, "headings0", "rate").what,
              HasSubstr("zeros of the steering that are all off by half a turn look the same"));
}

TEST(InspectHeadings, TellsThatTheyAreLate) {
  const Inspection late =
      with_heading("viwo_swerve", [](HeadingSample& s) { s.t_ns += 150'000'000; });
  EXPECT_THAT(faults_of(late), ElementsAre("wheels0 clock"));
  EXPECT_NEAR(figure_of(finding_of(late, "wheels0", "clock"), "lag"), -0.15, 0.01);
}

/// Wheels and poses of a robot that is asked every 0.8 s.
Inspection of_a_slow_robot(const std::function<void(EncoderSample&)>& fault) {
  RunSetup setup = read_run(
      config::parse(
          "sensors: {sim: {type: planar_simulator, motion: figure_eight, duration_s: 400, "
          "speed_m_per_s: 0.1, yaw_rate_rad_per_s: 0.3, rate_hz: 1.25, reference_rate_hz: 1.25, "
          "robot: &robot {type: differential, radius_left_m: 0.02, radius_right_m: 0.02, "
          "baseline_m: 0.09}}}\nkinematics: *robot\nevaluation: {reference_max_gap_s: 2}\n",
          "run.yaml"),
      testing::registry());
  return inspected(std::move(setup), {.wheels = [&fault](EncoderSample& s) {
                     fault(s);
                     return true;
                   }});
}

TEST(InspectSlowSensors, AreComparedAsOthersAre) {
  const Inspection right = of_a_slow_robot([](EncoderSample&) {});
  EXPECT_THAT(faults_of(right), IsEmpty());
  const Finding clock = finding_of(right, "poses0", "clock");
  EXPECT_GT(figure_of(clock, "correlation"), 0.9);
  // A reading of the simulator is the speed at an instant, half a period from the middle.
  EXPECT_LT(std::abs(figure_of(clock, "lag")), 0.5);
  const Inspection exchanged = of_a_slow_robot(
      [](EncoderSample& s) { std::swap(s.drive_rad_per_s[0], s.drive_rad_per_s[1]); });
  EXPECT_THAT(faults_of(exchanged), Contains("poses0 clock"));
  EXPECT_THAT(finding_of(exchanged, "poses0", "clock").what, HasSubstr("left and right exchanged"));
  const Inspection degrees = of_a_slow_robot([](EncoderSample& s) {
    for (double& rate : s.drive_rad_per_s) rate *= kDegree / 2.;
  });
  EXPECT_THAT(finding_of(degrees, "wheels0", "motion").what,
              HasSubstr(" rad/s, while poses0 goes "));
}

TEST(InspectStampsInAnotherUnit, MakeARecordingInWhichNothingShows) {
  RunSetup setup = setup_of(testing::configuration("runs/simulated_swerve.yaml"));
  const Inspection found = inspected(std::move(setup), {.wheels =
                                                            [](EncoderSample& s) {
                                                              s.t_ns /= 1000, s.begin_ns /= 1000,
                                                                  s.end_ns /= 1000;
                                                              return true;
                                                            },
                                                        .poses =
                                                            [](PoseSample& s) {
                                                              s.t_ns /= 1000;
                                                              return true;
                                                            }});
  EXPECT_THAT(finding_of(found, "recording", "overlap").what,
              HasSubstr("are its stamps in another unit?"));
}

}  // namespace
}  // namespace viwo::inspect
