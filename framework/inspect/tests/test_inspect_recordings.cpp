// Recordings without a fault, simulated and real, have no findings; what is known to be wrong with
// some of the real ones is found.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "inspected.hpp"
#include "khepera_log.hpp"

namespace viwo::inspect {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<std::string> faults_in(RunSetup setup) { return faults_of(inspect(setup)); }

TEST(Inspection, FindsNothingInSimulatedRecordings) {
  for (const char* name : {"viwo_swerve", "viwo_skid_steer", "viwo_ackermann", "viwo_mecanum",
                           "viwo_images", "viwo_gnss"}) {
    EXPECT_THAT(faults_in(simulated(name)), IsEmpty()) << name;
  }
  EXPECT_THAT(faults_in(setup_of(testing::configuration("runs/simulated_swerve.yaml"))), IsEmpty());
}

TEST(Inspection, FindsNothingWhereTheCalibrationStartsWrongAsFarAsItsPriorSays) {
  for (const char* name : {"viwo_swerve", "viwo_skid_steer", "viwo_ackermann", "viwo_mecanum"}) {
    for (int seed = 1; seed <= 4; ++seed) {
      const std::string seeded = "seed=" + std::to_string(seed);
      EXPECT_THAT(faults_in(setup_of(testing::configuration("runs/" + std::string(name) + ".yaml"),
                                     {seeded})),
                  IsEmpty())
          << name << " " << seed;
    }
  }
}

TEST(Inspection, FindsNothingInRealRecordingsThatAreWell) {
  if (!std::filesystem::exists(shared_data())) GTEST_SKIP() << shared_data() << " is not there";
  for (const char* name :
       {"comma2k19_car", "euroc_board", "husky_gnss", "hybrid", "openvins_sim"}) {
    EXPECT_THAT(faults_in(setup_of(testing::configuration("runs/" + std::string(name) + ".yaml"))),
                IsEmpty())
        << name;
  }
  for (const char* recording : {"1", "6", "11", "16", "21", "26"}) {
    EXPECT_THAT(faults_in(setup_of(testing::configuration("runs/recording.yaml"),
                                   {std::string("placeholders.recording=") + recording})),
                IsEmpty())
        << recording;
  }
}

// It turns on the spot: all that looks like straight way are scans that were matched wrongly.
TEST(Inspection, FindsNothingInARobotThatTurnsOnTheSpot) {
  const auto tuples = shared_data() / "real/censi_khepera_tuples/l90.tuple";
  if (!std::filesystem::exists(tuples)) GTEST_SKIP() << tuples << " is not there";
  const auto folder = std::filesystem::path(::testing::TempDir()) / "viwo_inspect_khepera";
  testing::write_khepera_log(tuples, folder);
  EXPECT_THAT(faults_in(setup_of(folder / "run.yaml")), IsEmpty());
}

// The ICRs of its configuration are first guesses, and it skids more than they say: within what the
// configuration admits not to know, beyond what it says otherwise.
TEST(Inspection, FindsThatASkidSteeredBaseSkidsMoreThanIsKnownOfIt) {
  if (!std::filesystem::exists(shared_data())) GTEST_SKIP() << shared_data() << " is not there";
  const auto file = testing::configuration("runs/ucsd_skid_steer.yaml");
  for (const char* run : {"run_20", "run_21"}) {
    EXPECT_THAT(faults_in(setup_of(file, {std::string("placeholders.run=") + run})), IsEmpty())
        << run;
  }
  EXPECT_THAT(faults_in(setup_of(file, {"kinematics.prior_sigma_icr_m=0.01"})),
              ElementsAre("imu0 rate"));
}

// A helicopter on the floor with its rotors idling, for 3 s.
TEST(Inspection, FindsAnImuThatIsShakenAtRest) {
  const auto folder = shared_data() / "real/euroc_v1_01_start/mav0";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
  RunSetup setup = setup_of(testing::configuration("runs/euroc.yaml"),
                            {"placeholders.data=" + (shared_data() / "real").string(),
                             "placeholders.sequence=euroc_v1_01_start"});
  const Inspection inspection = inspect(setup);
  EXPECT_THAT(faults_of(inspection), IsEmpty());
  for (const char* check : {"gyro noise", "accelerometer noise"}) {
    EXPECT_EQ(finding_of(inspection, "imu0", check).severity, Severity::kNote) << check;
    EXPECT_GT(figure_of(finding_of(inspection, "imu0", check), "found by configured"), 9.) << check;
  }
  EXPECT_NEAR(figure_of(finding_of(inspection, "imu0", "gravity"), "gravity"), 9.78, 0.02);
}

// A log has both, under names that are nearly the same.
TEST(Inspection, FindsTheStatesThatAProgramCommandedInThePlaceOfThoseThatItMeasured) {
  if (!std::filesystem::exists(shared_data())) GTEST_SKIP() << shared_data() << " is not there";
  const RunSetup commanded =
      setup_of(testing::configuration("runs/frc_swerve.yaml"),
               {"sensors.wheels0.module_entries=[/Chassis/TargetFrontLeftModuleState, "
                "/Chassis/TargetFrontRighttModuleState, /Chassis/TargetBackLeftModuleState, "
                "/Chassis/TargetBackRightModuleState]",
                "kinematics.x_m=[0.28575, 0.28575, -0.28575, -0.28575]",
                "kinematics.y_m=[0.28575, -0.28575, 0.28575, -0.28575]"});
  const auto says_so = [](RunSetup setup) {
    const Inspection inspection = inspect(setup);
    return finding_of(inspection, "wheels0", "parity").what.find("setpoints") != std::string::npos;
  };
  EXPECT_TRUE(says_so(commanded));
  EXPECT_FALSE(says_so(setup_of(testing::configuration("runs/frc_swerve.yaml"))));
}

TEST(Inspection, FindsTheSteeringOfARealCarInDegrees) {
  if (!std::filesystem::exists(shared_data())) GTEST_SKIP() << shared_data() << " is not there";
  const auto file = testing::configuration("runs/comma2k19_car.yaml");
  EXPECT_THAT(faults_in(setup_of(file, {"sensors.wheels0.steer_scale=[57.29578]"})),
              ElementsAre("wheels0 steering"));
}

TEST(Inspection, FindsTheWheelOfARealCarThatIsFast) {
  if (!std::filesystem::exists(shared_data())) GTEST_SKIP() << shared_data() << " is not there";
  const auto file = testing::configuration("runs/comma2k19_car.yaml");
  const std::array names{"r_rear_left", "r_rear_right", "r_front_left", "r_front_right"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::array<std::string, 4> scale{"1", "1", "1", "1"};
    scale[i] = "1.03";
    RunSetup setup = setup_of(file, {"sensors.wheels0.drive_scale=[" + scale[0] + "," + scale[1] +
                                     "," + scale[2] + "," + scale[3] + "]"});
    const Inspection found = inspect(setup);
    EXPECT_THAT(faults_of(found), ElementsAre("wheels0 intrinsics"));
    EXPECT_NEAR(figure_of(finding_of(found, "wheels0", "intrinsics"), names[i]), 0.35 / 1.03, 2e-3);
  }
}

TEST(Inspection, TellsTheJitterOfACanBus) {
  if (!std::filesystem::exists(shared_data())) GTEST_SKIP() << shared_data() << " is not there";
  RunSetup setup = setup_of(testing::configuration("runs/comma2k19_car.yaml"));
  const Finding stamps = finding_of(inspect(setup), "wheels0", "stamps");
  EXPECT_NEAR(figure_of(stamps, "rate"), 83., 2.);
  EXPECT_NEAR(figure_of(stamps, "longest interval"), 0.0265, 1e-3);
  RunSetup again = setup_of(testing::configuration("runs/comma2k19_car.yaml"));
  EXPECT_EQ(finding_of(inspect(again), "wheels0", "jitter").severity, Severity::kNote);
}

}  // namespace
}  // namespace viwo::inspect
