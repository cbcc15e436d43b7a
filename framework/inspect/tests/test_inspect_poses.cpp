// Faults of poses, put into simulated recordings, and what poses tell of the wheels.
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "inspected.hpp"

namespace viwo::inspect {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(InspectPoses, TellThatTheWheelsTurnLessThanTheyDo) {
  EXPECT_EQ(
      finding_of(by_poses_alone(two_drives(), [](EncoderSample&) {}), "wheels0", "turns").what, "");
  const Inspection narrow =
      by_poses_alone(two_drives({"kinematics.y_icr_left_m=0.15", "kinematics.y_icr_right_m=-0.15"}),
                     [](EncoderSample&) {});
  EXPECT_THAT(faults_of(narrow), ElementsAre("wheels0 turns"));
  const Finding turns = finding_of(narrow, "wheels0", "turns");
  EXPECT_NEAR(turns.figures.at(0).value, 2., 0.05);
  EXPECT_THAT(turns.what, HasSubstr("width of the base (baseline, track, centres of rotation)"));
  // Skid-steered bases are often said to be wider by some part.
  const Inspection wide =
      by_poses_alone(two_drives({"kinematics.y_icr_left_m=0.4", "kinematics.y_icr_right_m=-0.4"}),
                     [](EncoderSample&) {});
  EXPECT_THAT(faults_of(wide), IsEmpty());
  EXPECT_EQ(finding_of(wide, "wheels0", "turns").severity, Severity::kNote);
}

TEST(InspectPoses, TellTheirUnitAndThatOfSpeeds) {
  const auto what = [](double of_poses, double of_drives, const char* sensor, const char* check) {
    const RunSetup planar = setup_of(testing::configuration("runs/simulated_swerve.yaml"));
    const Inspection found = inspected(planar, {.wheels =
                                                    [=](EncoderSample& s) {
                                                      for (double& r : s.drive_rad_per_s) {
                                                        r *= of_drives;
                                                      }
                                                      return true;
                                                    },
                                                .poses =
                                                    [=](PoseSample& s) {
                                                      scale(s.p_BinW_m, of_poses);
                                                      return true;
                                                    }});
    return finding_of(found, sensor, check).what;
  };
  EXPECT_THAT(what(100., 1., "wheels0", "speed"), HasSubstr("positions of poses0 are in cm"));
  EXPECT_THAT(what(1000., 1., "poses0", "jumps"), HasSubstr("their unit (mm for m?)"));
  EXPECT_THAT(what(1., 3.6, "wheels0", "speed"), HasSubstr("drives are in km/h"));
}

TEST(InspectPoses, TellTheScaleOfAGyro) {
  const auto turns = [](double scale_of_gyro) {
    return finding_of(inspected(swerve(), {.imu =
                                               [=](ImuSample& s) {
                                                 scale(s.gyro_rad_per_s, scale_of_gyro);
                                                 return true;
                                               }}),
                      "states0", "turns");
  };
  EXPECT_EQ(turns(1.).what, "");
  EXPECT_EQ(turns(1.02).what, "");
  EXPECT_EQ(turns(1.1).severity, Severity::kFault);
  EXPECT_THAT(turns(1.1).what, HasSubstr("the scale of the gyro"));
  EXPECT_EQ(turns(0.9).severity, Severity::kFault);
}

TEST(InspectPoses, TellThatTheirQuaternionsAreReadInAnotherOrder) {
  using Quaternion = std::array<double, 4>;  // x, y, z, w
  const auto orientation = [](const std::function<Quaternion(const Quaternion&)>& read) {
    return finding_of(inspected(setup_of(testing::configuration("runs/simulated_swerve.yaml")),
                                {.poses =
                                     [&](PoseSample& s) {
                                       s.q_BtoW_xyzw = read(s.q_BtoW_xyzw);
                                       return true;
                                     }}),
                      "poses0", "orientation");
  };
  EXPECT_EQ(orientation([](const Quaternion& q) { return q; }).what, "");
  const auto w_first = orientation([](const Quaternion& q) {
    return Quaternion{q[3], q[0], q[1], q[2]};
  });
  EXPECT_EQ(w_first.severity, Severity::kFault);
  EXPECT_THAT(w_first.what, HasSubstr("read as w, x, y, z"));
  const auto w_last = orientation([](const Quaternion& q) {
    return Quaternion{q[1], q[2], q[3], q[0]};
  });
  EXPECT_EQ(w_last.severity, Severity::kFault);
  EXPECT_THAT(w_last.what, HasSubstr("read as x, y, z, w"));
  // The other way round is another fault.
  EXPECT_EQ(orientation([](const Quaternion& q) {
              return Quaternion{-q[0], -q[1], -q[2], q[3]};
            }).what,
            "");
  const auto none = orientation([](const Quaternion&) { return Quaternion{0., 0., 0., 1.}; });
  EXPECT_EQ(none.severity, Severity::kNote);
  EXPECT_THAT(none.what, HasSubstr("never changes"));
}

TEST(InspectPoses, TellThatAnotherAxisOfTheirWorldPointsUp) {
  const auto turned = [](const Eigen::Quaterniond& R) {
    return finding_of(inspected(setup_of(testing::configuration("runs/simulated_swerve.yaml")),
                                {.poses =
                                     [&](PoseSample& s) {
                                       const Eigen::Vector3d p = R * to_vector(s.p_BinW_m);
                                       const auto& q = s.q_BtoW_xyzw;
                                       const Eigen::Quaterniond there =
                                           R * Eigen::Quaterniond(q[3], q[0], q[1], q[2]);
                                       s.p_BinW_m = {p.x(), p.y(), p.z()};
                                       s.q_BtoW_xyzw = {there.x(), there.y(), there.z(), there.w()};
                                       return true;
                                     }}),
                      "poses0", "orientation");
  };
  const auto z_to = [](const Eigen::Vector3d& up) {
    return Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), up);
  };
  EXPECT_THAT(turned(z_to(Eigen::Vector3d::UnitY())).what,
              HasSubstr("turn about y of their world"));
  EXPECT_THAT(turned(z_to(-Eigen::Vector3d::UnitY())).what,
              HasSubstr("turn about -y of their world"));
}

TEST(InspectPoses, ThatAreCorrectedWhileTheBaseStandsTellNoSpeed) {
  const RunSetup planar = setup_of(testing::configuration("runs/simulated_swerve.yaml"));
  const Inspection stands = inspected(planar, {.wheels = [](EncoderSample& s) {
                                        if (s.t_ns < 5'000'000'000) return true;
                                        s.drive_rad_per_s.fill(0.);
                                        return true;
                                      }});
  EXPECT_EQ(finding_of(stands, "wheels0", "speed").severity, Severity::kFits)
      << finding_of(stands, "wheels0", "speed").what;
}

TEST(InspectPoses, TellsThoseThatJump) {
  std::int64_t n = 0;
  const Inspection jumps = inspected(setup_of(testing::configuration("runs/simulated_swerve.yaml")),
                                     {.poses = [&n](PoseSample& s) {
                                       if (++n % 10 == 0) s.p_BinW_m = {0., 0., 0.};
                                       if (n % 10 == 5) s.p_BinW_m[0] += 50.;
                                       return true;
                                     }});
  EXPECT_THAT(faults_of(jumps), ElementsAre("poses0 jumps"));
  EXPECT_GT(figure_of(finding_of(jumps, "poses0", "jumps"), "to zero"), 0.);
  EXPECT_EQ(finding_of(jumps, "wheels0", "heading").what, "");
}

TEST(InspectPoses, DoNotTellTheSpeedOfASlowRobotByTheirErrors) {
  constexpr double kSlow = 0.01;
  std::int64_t n = 0;
  const Inspection slow =
      inspected(setup_of(testing::configuration("runs/simulated_swerve.yaml"),
                         {"sensors.simulator0.duration_s=600", "placeholders.motion=straight"}),
                {.wheels =
                     [](EncoderSample& s) {
                       for (double& rate : s.drive_rad_per_s) rate *= kSlow;
                       return true;
                     },
                 .poses =
                     [&n](PoseSample& s) {
                       for (double& at : s.p_BinW_m) at *= kSlow;
                       if (++n % 600 == 0) s.p_BinW_m[0] += 0.04;
                       return true;
                     }});
  EXPECT_EQ(finding_of(slow, "wheels0", "speed").severity, Severity::kFits)
      << finding_of(slow, "wheels0", "speed").what;
  EXPECT_NEAR(figure_of(finding_of(slow, "wheels0", "speed"), "wheels by poses"), 1., 0.1);
}

// Poses of others take their frame as it comes: what of them cannot belong together is told.
TEST(InspectPoses, TellsPositionsThatDoNotBelongToTheirOrientations) {
  const Inspection exchanged = inspected(
      setup_of(testing::configuration("runs/simulated_swerve.yaml")), {.poses = [](PoseSample& s) {
        std::swap(s.p_BinW_m[0], s.p_BinW_m[1]);
        return true;
      }});
  EXPECT_THAT(faults_of(exchanged), ElementsAre("wheels0 heading"));
  EXPECT_THAT(finding_of(exchanged, "wheels0", "heading").what,
              HasSubstr("x and y exchanged or mirrored"));
}

TEST(InspectPoses, TellsOrientationsThatFlip) {
  const Inspection flips = inspected(setup_of(testing::configuration("runs/simulated_swerve.yaml")),
                                     {.poses = [](PoseSample& s) {
                                       const bool flipped = s.t_ns / 100'000'000 % 100 == 50;
                                       if (!flipped) return true;
                                       const auto q = s.q_BtoW_xyzw;  // half a turn about z
                                       s.q_BtoW_xyzw = {q[1], -q[0], q[3], -q[2]};
                                       return true;
                                     }});
  EXPECT_THAT(faults_of(flips), ElementsAre("poses0 jumps"));
  EXPECT_THAT(finding_of(flips, "poses0", "jumps").what, HasSubstr("its orientation flips"));
}

}  // namespace
}  // namespace viwo::inspect
