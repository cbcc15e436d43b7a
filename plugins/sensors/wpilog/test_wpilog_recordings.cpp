// The logs of a real swerve robot, if they are there, against the table that somebody else made of
// one of them.
#include <cmath>

#include "test_fixture.hpp"

namespace viwo::wpilog {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class FrcSwerve : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(folder_)) GTEST_SKIP() << "no recordings in " << folder_;
  }
  std::string section(const std::string& name, const std::string& rest) const {
    return "{type: wpilog, path: " + (folder_ / name).string() + ", " + rest + "}";
  }
  std::string driven(const std::string& modules) const {
    return section("FRC_20240910_002841.wpilog.gz",
                   "module_entries: [" + modules +
                       "], wheel_radius_m: 0.0508, cycle_entry: /Chassis/ActualSpeed");
  }
  const std::filesystem::path folder_ =
      std::filesystem::path(VIWO_TEST_SHARED_DIR) / "data/real/frc_swerve";
};

TEST_F(FrcSwerve, ModulesAreThoseOfTheConversion) {
  const auto sensor = make_sensor(
      driven("/Chassis/ActualFrontLeftModuleState, /Chassis/ActualBackRightModuleState"));
  const auto samples = only<EncoderSample>(play(*sensor));
  const auto converted = play_only<EncoderSample>(
      "{type: asl_encoders, path: " + (folder_ / "asl/wheels0").string() + "}");
  EXPECT_THAT(rejections_of(*sensor),
              ElementsAre(HasSubstr("wheels: gap longer than 0.2 s | 2 | ")))
      << "one behind the first cycle";
  ASSERT_EQ(converted.size(), 3211U + 15U) << "of a rest of which nothing is written";
  // The conversion leaves the first cycle out, and with it the rest of 2.6 s behind.
  constexpr std::size_t kLeftOut = 130;
  ASSERT_EQ(samples.size(), converted.size() + kLeftOut);
  for (std::size_t k = 0; k < converted.size(); ++k) {
    const EncoderSample &a = samples[k + kLeftOut], &b = converted[k];
    ASSERT_EQ(a.t_ns, b.t_ns);
    // The table has six decimals.
    ASSERT_NEAR(a.drive_rad_per_s[0], b.drive_rad_per_s[0], 6e-7) << k;
    ASSERT_NEAR(a.drive_rad_per_s[1], b.drive_rad_per_s[3], 6e-7) << k;
    ASSERT_NEAR(a.steer_rad[0], b.steer_rad[0], 6e-7) << k;
    ASSERT_NEAR(a.steer_rad[1], b.steer_rad[3], 6e-7) << k;
  }
}

TEST_F(FrcSwerve, TheEntryOfTwoModulesIsRefused) {
  EXPECT_THAT(error_of(driven("/Chassis/ActualFrontRightModuleState")),
              AllOf(HasSubstr("the entry '/Chassis/ActualFrontRightModuleState' has two values "
                              "within 0.002 s "),
                    HasSubstr(" times in 2208 records"),
                    HasSubstr("are two things written under one name?")));
}

TEST_F(FrcSwerve, PosesOfTheEstimatorAreRead) {
  const auto sensor =
      make_sensor(section("FRC_20240910_002841.wpilog.gz", "pose_entries: [/Chassis/Pose]"));
  EXPECT_EQ(play(*sensor).size(), 3212U);
  EXPECT_THAT(rejections_of(*sensor), ElementsAre(HasSubstr("poses: gap longer than 0.2 s | ")));
}

TEST_F(FrcSwerve, PosesInThreeEntriesAreReadFromTheOtherLog) {
  const auto sensor = make_sensor(section(
      "FRC_20240814_235409.3.wpilog.gz",
      "pose_entries: [/Pose/RobotPoseX, /Pose/RobotPoseY, /Pose/RobotPoseAngle], yaw_unit: deg"));
  const auto poses = only<PoseSample>(play(*sensor));
  ASSERT_EQ(poses.size(), 25082U);
  EXPECT_EQ(poses.front().t_ns, 247'949'123'000);
  EXPECT_EQ(poses.back().t_ns, 749'569'375'000);
  // It is the third file of a session: three records stand before the starts of their entries.
  EXPECT_THAT(rejections_of(*sensor), ElementsAre("record of an entry that was not started | 3 | "
                                                  "FRC_20240814_235409.3.wpilog.gz: byte 12"));
}

TEST_F(FrcSwerve, AWrongNameIsAnsweredWithTheRightOne) {
  EXPECT_THAT(error_of(driven("/Chassis/ActualFrontLeftModulState")),
              HasSubstr("did you mean '/Chassis/ActualFrontLeftModuleState'?"));
}

}  // namespace
}  // namespace viwo::wpilog
