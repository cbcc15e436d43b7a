// Faults of encoders, put into simulated recordings.
#include <cmath>
#include <cstdint>
#include <deque>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "inspected.hpp"
#include "setpoints.hpp"

namespace viwo::inspect {
namespace {

using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

TEST(InspectWheels, ThatNeverTurnWhileTheGyroDoesAreNotConnected) {
  const auto motion = [](double gyro) {
    return finding_of(inspected(swerve(), {.imu =
                                               [=](ImuSample& s) {
                                                 scale(s.gyro_rad_per_s, gyro);
                                                 return true;
                                               },
                                           .wheels =
                                               [](EncoderSample& s) {
                                                 s.drive_rad_per_s.fill(0.);
                                                 return true;
                                               },
                                           .states = [](StateSample&) { return false; }}),
                      "wheels0", "motion");
  };
  EXPECT_EQ(motion(1.).severity, Severity::kFault);
  EXPECT_THAT(motion(1.).what, HasSubstr("while imu0 turns with"));
  EXPECT_EQ(motion(0.01).severity, Severity::kNote);
}

TEST(InspectWheels, TellsADriveThatNeverChanges) {
  const Inspection dead = with_wheels(simulated("viwo_skid_steer"),
                                      [](EncoderSample& s) { s.drive_rad_per_s[0] = 0.; });
  EXPECT_THAT(faults_of(dead), Contains("wheels0 channel"));
  EXPECT_THAT(finding_of(dead, "wheels0", "channel").what, HasSubstr("drive_1 reads 0 rad/s"));
}

TEST(InspectWheels, TellsASteeringThatNeverChanges) {
  // One of four, the others move; or the only one, and the base turns as the gyro says.
  for (const char* robot : {"viwo_swerve", "viwo_ackermann"}) {
    const Inspection stuck =
        with_wheels(simulated(robot), [](EncoderSample& s) { s.steer_rad[0] = 0.03; });
    EXPECT_THAT(faults_of(stuck), Contains("wheels0 channel")) << robot;
    EXPECT_THAT(finding_of(stuck, "wheels0", "channel").what,
                HasSubstr("steer_1 reads 0.03 rad all the time"))
        << robot;
  }
}

TEST(InspectWheels, TellsWhatAProgramCommandedInPlaceOfReadings) {
  const Inspection commanded = with_wheels(simulated("viwo_swerve"), [](EncoderSample& s) {
    testing::make_setpoints(s, 0.1125, 0.0255);
  });
  EXPECT_THAT(faults_of(commanded), Contains("wheels0 parity"));
  EXPECT_THAT(finding_of(commanded, "wheels0", "parity").what, HasSubstr("setpoints"));
}

/// Two sides, each read once for two wheels.
TEST(InspectWheels, TakesCopiesOfAReadingForWhatTheyAre) {
  const Inspection copies = with_wheels(simulated("viwo_swerve"), [](EncoderSample& s) {
    s.drive_rad_per_s.fill(s.drive_rad_per_s[0]);
    s.steer_rad.fill(s.steer_rad[0]);
  });
  EXPECT_EQ(finding_of(copies, "wheels0", "parity").severity, Severity::kFits);
}

TEST(InspectWheels, TellsThatTheSteeringIsReadLate) {
  constexpr std::size_t kLate = 10;
  for (const char* robot : {"viwo_swerve", "viwo_ackermann"}) {
    std::deque<EncoderSample> before;
    const Inspection late = with_wheels(simulated(robot), [&](EncoderSample& s) {
      before.push_back(s);
      s.steer_rad = before.front().steer_rad;
      if (before.size() > kLate) before.pop_front();
    });
    EXPECT_THAT(faults_of(late), ElementsAre("wheels0 steer lag")) << robot;
    const double period_s = 1. / 100.;
    EXPECT_NEAR(figure_of(finding_of(late, "wheels0", "steer lag"), "lag"), kLate * period_s,
                0.5 * period_s)
        << robot;
  }
}

/// Driven along a circle, one angle is right, and turning on the spot, now more and now less, with
/// wheels that were steered before.
TEST(InspectWheels, LetsASteeringStandWhereTheBaseTurnsAsItSays) {
  std::optional<EncoderSample> first;
  const auto held = [&first](EncoderSample& s) {
    if (!first && s.t_ns > 2'000'000'000) first = s;
    if (first) s.steer_rad = first->steer_rad;
    return first.has_value();
  };
  const Inspection circle =
      inspected(simulated("viwo_ackermann", {"placeholders.motion=circle"}), {.wheels = held});
  EXPECT_THAT(faults_of(circle), Not(Contains("wheels0 channel")));

  first.reset();
  const auto part = [](std::int64_t t_ns) { return std::sin(1e-9 * static_cast<double>(t_ns)); };
  const Inspection spin = inspected(
      simulated("viwo_swerve", {"placeholders.motion=spin", "sensors.simulator0.ground=flat"}),
      {.imu =
           [&](ImuSample& s) {
             scale(s.gyro_rad_per_s, part(s.t_ns));
             return true;
           },
       .wheels =
           [&](EncoderSample& s) {
             for (double& rate : s.drive_rad_per_s) rate *= part(s.t_ns);
             return held(s);
           }});
  EXPECT_THAT(faults_of(spin), Not(Contains("wheels0 channel")));
}

/// The rear of a base that is steered in front alone.
TEST(InspectWheels, LetsASteeringStandThatNothingContradicts) {
  const std::string robot =
      "type: four_wis_wid, x_m: [1, -1, -1, 1], y_m: [0.6, 0.6, -0.6, -0.6], radius_m: 0.3";
  const RunSetup setup = read_run(
      config::parse(
          "sensors:\n  simulator0: {type: simulator, duration_s: 40, features: 0, robot: {" +
              robot + "}, motion: figure_eight, speed_m_per_s: 1.5}\nkinematics: {" + robot +
              "}\nwheels: {sigma_R_ItoO_rad: [0.01, 0.01, 0.01]}\n"
              "updates: {wheel_odometry: {}}\n",
          "run.yaml"),
      testing::registry(), 1);
  // With O on the rear axle no wheel there is steered: all twists are as if it were.
  const WheelModel& model = *setup.filter->wheels.front().model;
  const Inspection inspection = with_wheels(setup, [&](EncoderSample& s) {
    const double t = 1e-9 * static_cast<double>(s.t_ns);
    const double omega = 0.3 * std::sin(0.4 * t);
    model.model().inverse(Twist(1., omega, omega), model.nominal(), RowVector::Zero(8), s);
  });
  EXPECT_THAT(faults_of(inspection), Not(Contains("wheels0 channel")));
}

TEST(InspectWheels, TellsTheWheelThatAllOthersContradictAndSinceWhen) {
  const Inspection blocked = with_wheels(swerve(), [](EncoderSample& s) {
    if (s.t_ns > 15'000'000'000 && s.t_ns < 17'000'000'000) s.drive_rad_per_s[1] = 0.;
  });
  EXPECT_THAT(faults_of(blocked), ElementsAre("wheels0 contradicted"));
  const Finding finding = finding_of(blocked, "wheels0", "contradicted");
  EXPECT_THAT(finding.what, HasSubstr("drive_2 is contradicted"));
  EXPECT_NEAR(figure_of(finding, "longest"), 2., 0.2);
}

TEST(InspectWheels, TellsThatTheyContradictEachOtherWhereNothingMendsIt) {
  const Inspection swapped = with_wheels(swerve(), [](EncoderSample& s) {
    if (s.t_ns < 20'000'000'000) return;
    std::swap(s.drive_rad_per_s[0], s.drive_rad_per_s[2]);
    std::swap(s.steer_rad[0], s.steer_rad[1]);
    s.steer_rad[3] *= -1.;
  });
  const Finding parity = finding_of(swapped, "wheels0", "parity");
  // What the gentle curves of that motion say against: their unit is not known to be the cause.
  EXPECT_THAT(faults_of(swapped), ElementsAre("wheels0 steering"));
  EXPECT_THAT(finding_of(swapped, "wheels0", "steering").what,
              HasSubstr("without any steering: its unit, order, signs"));
  EXPECT_THAT(parity.what, HasSubstr("contradict each other grossly"));
  for (const Finding& finding : swapped.findings) {
    EXPECT_FALSE(finding.check.starts_with("sigma_") && !finding.remedies.empty()) << finding.what;
  }
  const Inspection absurd = with_wheels(swerve(), [](EncoderSample& s) {
    for (double& rate : s.drive_rad_per_s) rate *= 1e308;
  });
  EXPECT_THAT(faults_of(absurd), Contains(AnyOf("wheels0 parity", "wheels0 contradicted")));
}

TEST(InspectWheels, WritesNoNoiseThatIsNone) {
  const Inspection faster = with_wheels(swerve(), [](EncoderSample& s) {
    s.drive_rad_per_s[0] *= 5.;
    s.drive_rad_per_s[2] *= -3.;
  });
  for (const Finding& finding : faster.findings) {
    EXPECT_FALSE(finding.check.starts_with("sigma_") && !finding.remedies.empty()) << finding.what;
  }
  EXPECT_THAT(faults_of(faster), Contains(AnyOf("wheels0 parity", "wheels0 contradicted")));
}

TEST(InspectWheels, TellsZerosThatStandForReadingsThatWereLost) {
  const auto of = [](double from_s, double to_s) {
    const Inspection found = with_wheels(swerve(), [=](EncoderSample& s) {
      const double t_s = 1e-9 * static_cast<double>(s.t_ns);
      if (t_s > from_s && t_s < to_s) s.drive_rad_per_s.fill(0.);
    });
    return finding_of(found, "wheels0", "zeros");
  };
  EXPECT_EQ(of(0., 0.).what, "");
  EXPECT_EQ(of(-1., 10.).what, "") << "a base that drives off after a rest";
  const Finding lost = of(12., 17.);
  EXPECT_EQ(lost.severity, Severity::kFault);
  EXPECT_THAT(lost.what, HasSubstr("all drives read exactly 0 for 5 s from t = 12"));
}

TEST(InspectWheels, TellsACounterThatWasSet) {
  std::int64_t n = 0;
  const Inspection jumps = with_wheels(swerve(), [&n](EncoderSample& s) {
    if (++n == 1000) s.drive_rad_per_s[2] -= 200. / seconds_between(s.begin_ns, s.end_ns);
  });
  const Finding jump = finding_of(jumps, "wheels0", "jumps");
  EXPECT_EQ(jump.severity, Severity::kFault);
  EXPECT_THAT(jump.what,
              HasSubstr("drive_3 jumps by up to 200 rad from one sample to the next (1"));
}

TEST(InspectWheels, FindsTheZeroOfASteeringAndWritesTheOffset) {
  EXPECT_EQ(
      finding_of(with_wheels(swerve(), [](EncoderSample&) {}), "wheels0", "steer offsets").severity,
      Severity::kFits);
  for (const double offset : {0.3, -1.2}) {
    const Inspection off =
        with_wheels(swerve(), [offset](EncoderSample& s) { s.steer_rad[1] += offset; });
    EXPECT_THAT(faults_of(off), ElementsAre("wheels0 steer offsets")) << offset;
    const Finding finding = finding_of(off, "wheels0", "steer offsets");
    EXPECT_NEAR(figure_of(finding, "offset of steer_2"), -offset, 0.02) << finding.what;
    EXPECT_NEAR(figure_of(finding, "offset of steer_1"), 0., 0.02) << finding.what;
    EXPECT_THAT(remedy_of(finding, "sensors.wheels0.steer_shift_rad"), ::testing::StartsWith("["));
  }
  const Inspection car =
      with_wheels(simulated("viwo_ackermann"), [](EncoderSample& s) { s.steer_rad[0] += 0.15; });
  EXPECT_THAT(faults_of(car), ElementsAre("wheels0 steer offsets"));
  EXPECT_NEAR(figure_of(finding_of(car, "wheels0", "steer offsets"), "offset of steer_1"), -0.15,
              0.03);
}

// Of four drives and three unknowns one contradiction is left, which radii make as well as zeros.
TEST(InspectWheels, DoesNotTakeRadiiForZeros) {
  for (const char* seed : {"seed=2", "seed=4"}) {
    RunSetup setup = setup_of(
        testing::configuration("runs/simulated_swerve.yaml"),
        {"kinematics.type=four_wis_wid_drive_only", seed, "sensors.simulator0.duration_s=40"});
    EXPECT_THAT(faults_of(inspect(setup)), IsEmpty()) << seed;
  }
}

TEST(InspectWheels, FindsMoreNoiseThanConfiguredAndWritesIt) {
  std::mt19937 random(1);
  std::normal_distribution<double> draw(0., 0.02);
  const Inspection noisy = with_wheels(swerve(), [&](EncoderSample& s) {
    for (int i = 0; i < s.n_drive; ++i) {
      s.drive_rad_per_s[static_cast<std::size_t>(i)] += draw(random);
    }
  });
  EXPECT_THAT(faults_of(noisy), Contains("wheels0 sigma_drive_rad_per_s"));
  EXPECT_NEAR(std::stod("0" + remedy_of(finding_of(noisy, "wheels0", "sigma_drive_rad_per_s"),
                                        "kinematics.sigma_drive_rad_per_s")),
              0.02, 0.004);
}

TEST(InspectWheels, FindsDrivesInOtherUnitsByTheGyroAndByPoses) {
  const auto in_rpm = [](EncoderSample& s) {
    for (double& rate : s.drive_rad_per_s) rate *= 30. / std::numbers::pi;
  };
  const Inspection by_gyro = with_wheels(swerve(), in_rpm);
  EXPECT_THAT(remedy_of(finding_of(by_gyro, "wheels0", "rate"), "sensors.wheels0.drive_scale"),
              HasSubstr("[0.104719"));
  const RunSetup planar = setup_of(testing::configuration("runs/simulated_swerve.yaml"));
  const Inspection by_poses = with_wheels(planar, in_rpm);
  const Finding speed = finding_of(by_poses, "wheels0", "speed");
  EXPECT_EQ(speed.severity, Severity::kFault);
  EXPECT_THAT(speed.what, HasSubstr("revolutions per minute"));
  EXPECT_THAT(remedy_of(speed, "sensors.wheels0.drive_scale"), HasSubstr("[0.104719"));
}

TEST(InspectWheels, FindsThatAllDrivesAreReversedByPoses) {
  const Inspection reversed = with_wheels(
      setup_of(testing::configuration("runs/simulated_swerve.yaml")), [](EncoderSample& s) {
        for (double& rate : s.drive_rad_per_s) rate *= -1.;
      });
  EXPECT_THAT(faults_of(reversed), Contains("wheels0 heading"));
}

TEST(InspectWheels, FindsAnAngleThatBeginsAnewAfterATurn) {
  double angle = 0.;
  const Inspection wraps = with_wheels(swerve(), [&angle](EncoderSample& s) {
    const double dt_s = seconds_between(s.begin_ns, s.end_ns);
    const double before = std::floor(angle / (2. * std::numbers::pi));
    angle += s.drive_rad_per_s[2] * dt_s;
    const double turns = std::floor(angle / (2. * std::numbers::pi)) - before;
    s.drive_rad_per_s[2] -= turns * 2. * std::numbers::pi / dt_s;
  });
  EXPECT_THAT(faults_of(wraps), Contains("wheels0 turn"));
  EXPECT_THAT(remedy_of(finding_of(wraps, "wheels0", "turn"), "sensors.wheels0.drive_turn"),
              ::testing::MatchesRegex("\\[0, 0, 6.2[0-9]+, 0\\]"));
}

TEST(InspectWheels, TellsSamplesWithoutTheChannelsOfTheModel) {
  const Inspection few = with_wheels(swerve(), [](EncoderSample& s) { s.n_steer = 2; });
  EXPECT_THAT(faults_of(few), Contains("wheels0 channels"));
}

TEST(InspectWheels, NamesWhatIsUpsideDownOrReversed) {
  const Inspection imu = inspected(swerve(), {.imu = [](ImuSample& s) {
                                     for (std::size_t i = 1; i < 3; ++i) {
                                       s.gyro_rad_per_s[i] *= -1.;
                                       s.accel_m_per_s2[i] *= -1.;
                                     }
                                     return true;
                                   }});
  EXPECT_THAT(faults_of(imu), ElementsAre("imu0 up"));
  EXPECT_EQ(remedy_of(finding_of(imu, "imu0", "up"), "wheels.rpy_ItoO_rad"), "[3.141593, 0, 0]");
  const Inspection drives = with_wheels(swerve(), [](EncoderSample& s) {
    for (double& rate : s.drive_rad_per_s) rate *= -1.;
  });
  EXPECT_EQ(remedy_of(finding_of(drives, "wheels0", "rate"), "sensors.wheels0.drive_scale"),
            "[-1, -1, -1, -1]");
  const Inspection sides =
      with_wheels(simulated("viwo_skid_steer", {"sensors.simulator0.duration_s=30"}),
                  [](EncoderSample& s) { std::swap(s.drive_rad_per_s[0], s.drive_rad_per_s[1]); });
  EXPECT_THAT(finding_of(sides, "wheels0", "rate").what,
              HasSubstr("drives on the left and on the right are exchanged"));
}

// A gyro tells of wheels that cannot contradict each other when they turned otherwise, and which
// encoder stood still.
TEST(InspectWheels, TellsWhenABaseOfTwoDrivesSlippedOrAnEncoderStoodStill) {
  const auto during = [](const EncoderSample& s) {
    return s.t_ns > 10'000'000'000 && s.t_ns < 13'000'000'000;
  };
  const Inspection slips = with_wheels(two_drives(), [&](EncoderSample& s) {
    if (during(s)) s.drive_rad_per_s[0] *= 1.6;
  });
  EXPECT_THAT(faults_of(slips), ElementsAre("wheels0 slip"));
  const Finding slip = finding_of(slips, "wheels0", "slip");
  EXPECT_THAT(slip.what, HasSubstr("turns otherwise than imu0"));
  EXPECT_NEAR(figure_of(slip, "longest"), 3., 0.6);
  const Inspection stands = with_wheels(two_drives(), [&](EncoderSample& s) {
    if (during(s)) s.drive_rad_per_s[1] = 0.;
  });
  EXPECT_THAT(finding_of(stands, "wheels0", "slip").what,
              HasSubstr("(drive_2 reads 0 rad/s all that time)"));
  EXPECT_THAT(faults_of(with_wheels(two_drives(), [](EncoderSample&) {})), IsEmpty());
}

}  // namespace
}  // namespace viwo::inspect
