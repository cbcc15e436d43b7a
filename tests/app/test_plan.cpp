// viwo plan as a user meets it: exit codes, files, and the drive in a simulator and a calibration.
#include "support.hpp"

namespace viwo {
namespace {

using PlanTest = CommandLineTest;

const std::string kPlans = std::string(VIWO_TEST_SOURCE_DIR) + "/configs/plans/";

TEST_F(PlanTest, WritesADriveThatASimulatorFollowsAndACalibrationTakes) {
  const Outcome outcome = expect_done({"plan", kPlans + "swerve.yaml", "--out", "out"});
  EXPECT_EQ(outcome.err, "");
  EXPECT_NE(outcome.out.find("\nall goals are reached after "), std::string::npos) << outcome.out;
  const nlohmann::json plan = summary();
  EXPECT_EQ(plan.at("status"), "ok");
  for (const auto& goal : plan.at("goals")) {
    EXPECT_LE(goal.at("sigma").get<double>(), goal.at("goal").get<double>());
  }
  EXPECT_NE(read("out/report.html").find("Seen from above"), std::string::npos);
  const std::string drive = "placeholders.plan=" + at("out/plan.csv").string();
  expect_done({"simulate", kPlans + "swerve_drive.yaml", "--out", "log", "--set", drive});
  const Outcome calibrated = expect_done(
      {"calibrate", kPlans + "swerve_calibration.yaml", "--out", "calibrated", "--set", drive});
  EXPECT_NE(calibrated.out.find("delta_o4"), std::string::npos) << calibrated.out;
}

TEST_F(PlanTest, SaysThatThereIsNothingToDrive) {
  write("easy.yaml",
        "plan: easy\nkinematics: {type: differential, radius_left_m: 0.1, radius_right_m: 0.1, "
        "baseline_m: 0.5}\nbase_radius_m: 0.3\nfloor_x_m: 4\nfloor_y_m: 4\nmax_speed_m_per_s: "
        "0.5\nmax_yaw_rate_rad_per_s: 1\nmax_acceleration_m_per_s2: 0.5\ngoals: {r_left: 0.01}\n");
  const Outcome outcome = expect_done({"plan", "easy.yaml", "--out", "out"});
  EXPECT_NE(outcome.out.find("nothing to drive: all goals are within the priors of the kinematics "
                             "(the worst sigma is 0.03 (r_left) x its goal)"),
            std::string::npos)
      << outcome.out;
}

TEST_F(PlanTest, SaysWhatIsMissingOfARun) {
  const std::string run = kPlans + "../runs/viwo_swerve.yaml";
  const std::vector<std::string> words{"run",    run,
                                       "--out",  "out",
                                       "--set",  "placeholders.motion=circle",
                                       "--set",  "sensors.simulator0.duration_s=10",
                                       "--plan", kPlans + "swerve.yaml"};
  const Outcome outcome = expect_done(words);
  EXPECT_NE(outcome.out.find("forecast: delta_o"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find(" after another '"), std::string::npos) << outcome.out;
}

TEST_F(PlanTest, SaysWhatIsMissingThoughTheFilterIsSureOfIt) {
  // Wheels on tyres: the filter's sigma of each zero is below the goal of 1 mrad, by what it moves
  // it is not.
  const Outcome outcome = expect_done({"run", kPlans + "../runs/viwo_contact.yaml", "--seed", "7",
                                       "--out", "out", "--plan", kPlans + "swerve.yaml"});
  EXPECT_NE(outcome.out.find("forecast: delta_o"), std::string::npos) << outcome.out;
  for (const char* zero : {"delta_o2", "delta_o3", "delta_o4"}) {
    EXPECT_LT(summary().at("calibration").at(zero).at("sigma").get<double>(), 1e-3) << zero;
  }
}

TEST_F(PlanTest, OfAnotherBaseIsRefused) {
  expect_refused({"run", kPlans + "../runs/viwo_skid_steer.yaml", "--out", "out", "--plan",
                  kPlans + "swerve.yaml"},
                 "the plan is for another base: it has no intrinsic 'r_left'");
}

TEST_F(PlanTest, ThatTakesTooLongIsAFailure) {
  const Outcome outcome =
      viwo({"plan", kPlans + "swerve.yaml", "--out", "out", "--set", "max_path_m=2"});
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  EXPECT_NE(outcome.out.find("the goals are not reached: it would take more than max_path_m"),
            std::string::npos)
      << outcome.out;
  EXPECT_EQ(summary().at("status"), "failed");
}

TEST_F(PlanTest, RefusesWhatIsWrongAndWritesNothing) {
  const std::string file = kPlans + "swerve.yaml";
  expect_refused({"plan", file, "--out", "out", "--set", "floor_x_m=0.3"},
                 "--set floor_x_m  floor_x_m: a floor of 0.3 m has no room for a base of "
                 "base_radius_m 0.2");
  expect_refused({"plan", file, "--out", "out", "--set", "flor_x_m=3"},
                 "--set flor_x_m  plan: unknown key 'flor_x_m' - did you mean 'floor_x_m'?");
  const Outcome unreachable =
      viwo({"plan", file, "--out", "out", "--set", "kinematics.prior_sigma_position_m=0.05"});
  EXPECT_EQ(unreachable.code, 2) << unreachable.out;
  EXPECT_NE(unreachable.err.find("goals: r_"), std::string::npos) << unreachable.err;
  EXPECT_FALSE(std::filesystem::exists(at("out")));
}

}  // namespace
}  // namespace viwo
