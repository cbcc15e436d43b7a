// The figures of the recorded robot: nominal dead reckoning, calibration with one repetition left
// out.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "motion_reference.hpp"
#include "simulated.hpp"
#include "unknown_swerve.hpp"
#include "viwo/calibration/calibrate.hpp"
#include "viwo/experiment/experiment.hpp"
#include "viwo/math/se2.hpp"

namespace viwo {
namespace {

using namespace calibration;
using namespace experiment;
using testing::registry;

const std::filesystem::path kConfigs = std::filesystem::path(VIWO_TEST_SOURCE_DIR) / "configs";

class Recordings : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto data = std::filesystem::path(VIWO_TEST_SHARED_DIR) / "data" / "4wis4wid";
    if (!std::filesystem::exists(data)) GTEST_SKIP() << "no recordings at " << data;
  }
};

TEST_F(Recordings, NominalDeadReckoningEndsWhereOthersMeasured) {
  // Least-squares twist of the eight rows, drive angles from position differences, mm.
  const std::map<std::string, double> end_mm{
      {"1", 121.}, {"2", 127.}, {"3", 150.}, {"6", 235.}, {"7", 237.}, {"8", 229.},
      {"11", 45.}, {"12", 44.}, {"13", 44.}, {"16", 32.}, {"17", 33.}, {"18", 38.},
      {"21", 1.5}, {"22", 1.6}, {"23", 1.7}, {"26", 0.5}, {"27", 0.6}, {"28", 0.6}};
  const auto base = load_run_configuration(kConfigs / "runs" / "recording.yaml", {});
  for (const auto& [recording, expected_mm] : end_mm) {
    const auto result = testing::run(resolve_placeholders(base, {{"recording", recording}}));
    ASSERT_TRUE(result.accuracy);
    EXPECT_NEAR(1e3 * result.accuracy->end_m, expected_mm, 3.) << recording;
  }
}

TEST(RealCar, IsDoubtedWithAWheelThatCountsMoreThanTheOthers) {
  const auto data = std::filesystem::path(VIWO_TEST_SHARED_DIR) / "data" / "real";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no recordings at " << data;
  const auto file = std::filesystem::path(::testing::TempDir()) / "viwo_real_car.yaml";
  std::ofstream(file) << "calibration: car\nbase: "
                      << (kConfigs / "runs/comma2k19_car.yaml").string()
                      << "\nreference: gyro\nprior_sigma_clock_offset_s: 0.1\n"
                         "recordings: [{name: highway, distance_m: 1012, turn_deg: 0}]\n";
  const auto doubts = [&](const std::string& scale) {
    auto setup = read_calibration_setup(file,
                                        {"placeholders.data=" + data.string(),
                                         "sensors.wheels0.drive_scale=[" + scale + ", 1, 1, 1]"},
                                        registry());
    return calibrate(setup).doubts;
  };
  EXPECT_THAT(doubts("1"), ::testing::IsEmpty());
  EXPECT_THAT(doubts("1.03"), ::testing::Contains(::testing::HasSubstr("r_rear_left is 7.")));
}

TEST_F(Recordings, CalibrationPredictsTheRepetitionThatIsLeftOutAndHalfwaysTheMotion) {
  auto setup =
      read_calibration_setup(kConfigs / "calibrations" / "recordings.yaml", {}, registry());
  ASSERT_EQ(setup.recordings.size(), 18u);
  const auto result = calibrate(setup);
  EXPECT_TRUE(result.all.converged);
  const auto expect_below = [](const LeftOut& left_out, double most_m, double most_rad) {
    double end_m = 0., yaw_rad = 0.;
    for (const ValidationRun& run : left_out.runs) {
      end_m += run.calibrated.accuracy->end_m / 18.;
      yaw_rad += std::abs(run.calibrated.accuracy->end_yaw_deg) * M_PI / 180. / 18.;
    }
    EXPECT_EQ(left_out.runs.size(), 18u) << left_out.by;
    EXPECT_LT(end_m, most_m) << left_out.by;
    EXPECT_LT(yaw_rad, most_rad) << left_out.by;
  };
  ASSERT_EQ(result.left_out.size(), 2u);
  expect_below(result.left_out[0], 0.010, 0.012);
  // Without gains of the steering 65 mm, 0.040 rad; nominal 75 mm, 0.072 rad.
  expect_below(result.left_out[1], 0.040, 0.035);
}

/// By how much a recording has turned at its end [deg], as marks on the floor tell it.
double marked_deg(const Trajectory& poses) {
  double turn_rad = 0.;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    turn_rad += wrap_angle(yaw(poses[i]) - yaw(poses[i - 1]));
  }
  return 0.5 * std::round(2. * turn_rad * 180. / M_PI);
}

// Nothing of the motion capture but what a tape measure and chalk tell.
TEST_F(Recordings, AreCalibratedByATapeMeasureAndMarksOnTheFloor) {
  const auto calibrated_by = [](bool marks) {
    auto setup =
        read_calibration_setup(kConfigs / "calibrations" / "recordings.yaml", {}, registry());
    setup.leave_out_by.clear();
    setup.options.reference = ReferenceKind::kNone;
    for (CalibrationRecording& recording : setup.recordings) {
      Recording label = recording.label;
      const std::string& motion = label.labels.at("motion");
      if (motion == "forward") label.labels["distance_m"] = "4.07";
      if (motion == "crab") label.labels["distance_m"] = "4.06";
      if (marks) label.labels["turn_deg"] = std::to_string(marked_deg(recording.motion.poses));
      recording.motion =
          motion_reference(label, recording.setup, recording.data, ReferenceKind::kNone);
    }
    const CalibrationResult result = calibrate(setup);
    double end_m = 0.;
    for (const ValidationRun& run : result.fitted) end_m += run.calibrated.accuracy->end_m / 18.;
    return std::pair{result.is_trusted(), end_m};
  };
  const auto [trusts_marks, by_marks_m] = calibrated_by(true);
  EXPECT_TRUE(trusts_marks);
  EXPECT_LT(by_marks_m, 0.025);
  // The heading is in no distance: it says so.
  const auto [trusts_ruler, by_ruler_m] = calibrated_by(false);
  EXPECT_FALSE(trusts_ruler);
  EXPECT_GT(by_ruler_m, 0.05);
}

// Of a match: it slips, but one of two drives the wrong way round is something else.
TEST(FrcRecording, IsTrustedUnlessADriveIsReversed) {
  const auto data = std::filesystem::path(VIWO_TEST_SHARED_DIR) / "data" / "real" / "frc_swerve";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no recordings at " << data;
  const auto file = std::filesystem::path(::testing::TempDir()) / "viwo_frc_calibration.yaml";
  std::ofstream(file) << "calibration: frc\nbase: " << (kConfigs / "runs/frc_swerve.yaml").string()
                      << "\n";
  auto setup = read_calibration_setup(file, {}, registry());
  const CalibrationResult result = calibrate(setup);
  EXPECT_TRUE(result.is_trusted()) << ::testing::PrintToString(result.doubts);
  auto reversed = read_calibration_setup(file, {"sensors.wheels0.drive_scale=[1, -1]"}, registry());
  EXPECT_THAT(calibrate(reversed).doubts,
              ::testing::Contains(::testing::HasSubstr("still contradict each other by")));
}

// It turns little: what a reversed gyro leaves is less than the wheels slip. (That the heading, of
// the robot's own estimator, is 80 ms late, is another matter.)
TEST(FrcRecording, IsDoubtedWhereTheHeadingOfItsGyroIsReversed) {
  const auto log = std::filesystem::path(VIWO_TEST_SHARED_DIR) /
                   "data/real/frc_swerve/FRC_20240910_002841.wpilog.gz";
  if (!std::filesystem::exists(log)) GTEST_SKIP() << "no recording " << log;
  const auto folder = std::filesystem::path(::testing::TempDir());
  std::ofstream(folder / "run.yaml")
      << "sensors: {log0: {type: wpilog, path: " << log.string()
      << ", module_entries: [/Chassis/ActualFrontLeftModuleState, "
         "/Chassis/ActualBackRightModuleState], wheel_radius_m: 0.0508, cycle_entry: "
         "/Chassis/ActualSpeed, heading_entry: /Chassis/Pose/rotation}}\n"
         "kinematics: {type: four_wis_wid, x_m: [0.28575, -0.28575], y_m: [0.28575, -0.28575], "
         "radius_m: 0.0508, prior_sigma_radius_m: 0.002, prior_sigma_position_m: 0.005, "
         "prior_sigma_steer_offset_rad: 0.02, sigma_drive_rad_per_s: 0.5, sigma_steer_rad: 0.01, "
         "sigma_lateral_m_per_s: 0.05}\n";
  std::ofstream(folder / "calibration.yaml")
      << "calibration: frc\nbase: run.yaml\nreference: gyro\nprior_sigma_clock_offset_s: 0\n";
  const auto doubts = [&](double factor) {
    auto setup = read_calibration_setup(folder / "calibration.yaml", {}, registry());
    testing::scale_turns(setup.recordings[0].motion.poses, factor);
    return calibrate(setup).doubts;
  };
  EXPECT_THAT(doubts(1.), ::testing::IsEmpty());
  EXPECT_THAT(doubts(-1.), ::testing::Contains(::testing::HasSubstr("turns the other way")));
  EXPECT_THAT(doubts(M_PI / 180.), ::testing::Contains(::testing::HasSubstr("times as far")));
}

TEST_F(Recordings, ThreeModelsRunSideBySide) {
  ExperimentOptions options;
  const auto setup = read_experiment(kConfigs / "experiments" / "three_models.yaml", options);
  const auto result = run_experiment(setup, options, registry(), {});
  EXPECT_EQ(result.runs.size(), 54u);
  for (const ExperimentRun& run : result.runs) EXPECT_EQ(run.result.status, RunStatus::kOk);
}

}  // namespace
}  // namespace viwo
