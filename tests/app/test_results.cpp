// Results: files, reproducibility, and what happens when they cannot be written. Also: every
// configuration that is delivered loads.
#include <algorithm>
#include <map>
#include <set>
#include <sstream>

#include "support.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

using ResultsTest = CommandLineTest;

const std::string kConfigFolder = std::string(VIWO_TEST_SOURCE_DIR) + "/configs/";

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream text(line);
  for (std::string field; std::getline(text, field, ',');) fields.push_back(field);
  return fields;
}

/// runs.csv without the columns that tell how long something took.
std::string without_wall_clock(const std::string& csv) {
  std::istringstream text(csv);
  std::string line, result;
  std::vector<std::string> header;
  while (std::getline(text, line)) {
    const std::vector<std::string> fields = fields_of(line);
    if (header.empty()) header = fields;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const std::string& name = header.at(i);
      if (name.find("wall") != std::string::npos || name.find("realtime") != std::string::npos ||
          name.find("_ms") != std::string::npos || name.find("rss") != std::string::npos) {
        continue;
      }
      result += fields[i] + ",";
    }
    result += "\n";
  }
  return result;
}

TEST_F(ResultsTest, AreTheFilesOfTheContract) {
  write("run.yaml", kRun);
  const Outcome outcome = expect_done({"run", "run.yaml", "--out", "out"});
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(outcome.out.find("status ok\n"), 0U) << outcome.out;
  std::set<std::string> files;
  for (const auto& entry : fs::directory_iterator(at("out"))) {
    files.insert(entry.path().filename().string());
  }
  EXPECT_EQ(files, (std::set<std::string>{"config.resolved.yaml", "trajectory.tum", "reference.tum",
                                          "calibration.csv", "timing.csv", "summary.json",
                                          "report.html"}));
  const nlohmann::json json = summary();
  EXPECT_EQ(json.at("status"), "ok");
  EXPECT_EQ(json.at("seed"), 1);
  EXPECT_DOUBLE_EQ(json.at("duration_s").get<double>(), 5.);
  for (const char* key : {"epochs", "wall_s", "accuracy", "calibration", "updates", "timing_ms",
                          "realtime_factor", "peak_rss_mb"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
}

TEST_F(ResultsTest, GoToAFolderNamedAfterTheConfigurationByDefault) {
  write("run.yaml", kRun);
  expect_done({"run", "run.yaml"});
  EXPECT_TRUE(fs::exists(at("results/run/report.html")));
}

TEST_F(ResultsTest, AreTheSameForTheSameSeedAndOthersForAnother) {
  write("run.yaml", kRun);
  for (const auto& [folder, seed] : {std::pair{"a", "7"}, {"b", "7"}, {"c", "8"}}) {
    expect_done({"run", "run.yaml", "--out", folder, "--seed", seed});
  }
  EXPECT_EQ(read("a/trajectory.tum"), read("b/trajectory.tum"));
  EXPECT_NE(read("a/trajectory.tum"), read("c/trajectory.tum"));
  EXPECT_EQ(summary("c").at("seed"), 8);
}

TEST_F(ResultsTest, HoldTheConfigurationThatReproducesThem) {
  write("run.yaml", kRun);
  expect_done({"run", "run.yaml", "--out", "a", "--seed", "7", "--set", "odometry.epoch_s=0.25"});
  expect_done({"run", "a/config.resolved.yaml", "--out", "b"});
  EXPECT_EQ(read("a/trajectory.tum"), read("b/trajectory.tum"));
  EXPECT_EQ(read("a/config.resolved.yaml"), read("b/config.resolved.yaml"));
}

TEST_F(ResultsTest, OfAnExperimentDoNotDependOnTheNumberOfJobs) {
  write("run.yaml", replaced(kRun, "motion: circle", "motion: \"{motion}\""));
  write("e.yaml",
        "experiment: e\nbase: run.yaml\nseeds: 3\nmotions: [circle, straight, icr_sweep]\n"
        "variants:\n  redundant:\n  drive: {kinematics.type: four_wis_wid_drive_only}\n");
  expect_done({"experiment", "e.yaml", "--out", "one", "--jobs", "1"});
  expect_done({"experiment", "e.yaml", "--out", "two", "--jobs", "2"});
  const std::string one = without_wall_clock(read("one/runs.csv"));
  EXPECT_EQ(one, without_wall_clock(read("two/runs.csv")));
  EXPECT_EQ(std::count(one.begin(), one.end(), '\n'), 1 + 2 * 3 * 3);
  // What is left after the wall clock is taken out still tells runs apart.
  std::istringstream rows(one);
  std::set<std::string> different;
  for (std::string row; std::getline(rows, row);) different.insert(row);
  EXPECT_EQ(different.size(), 1U + 2 * 3 * 3);
}

TEST_F(ResultsTest, OfEachRunAreKeptOnRequest) {
  write("run.yaml", kRun);
  write("e.yaml", "experiment: e\nbase: run.yaml\nvariants:\n  a:\n  b:\n");
  expect_done({"experiment", "e.yaml", "--out", "out", "--keep-runs", "--seeds", "2"});
  for (const char* run : {"a_1", "a_2", "b_1", "b_2"}) {
    EXPECT_TRUE(fs::exists(at("out/runs") / run / "trajectory.tum")) << run;
  }
  EXPECT_EQ(read("out/runs/a_1/trajectory.tum"), read("out/runs/b_1/trajectory.tum"));
}

TEST_F(ResultsTest, ThatCannotBeWrittenAreAFailure) {
  write("run.yaml", kRun);
  const auto fail = [&](const std::string& out, const std::string& message) {
    const Outcome outcome = viwo({"run", "run.yaml", "--out", out});
    EXPECT_EQ(outcome.code, 1) << out;
    EXPECT_EQ(outcome.err, message + "\n");
  };
  fail("run.yaml", "cannot create the folder run.yaml: Not a directory");
  fail("run.yaml/sub", "cannot create the folder run.yaml/sub: Not a directory");
  fs::create_directories(at("blocked/report.html"));
  fail("blocked", "cannot write blocked/report.html: Is a directory");
}

TEST_F(ResultsTest, AreAFailureOnAFullDisk) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  write("run.yaml", kRun);
  for (const char* file :
       {"config.resolved.yaml.tmp", "trajectory.tum", "summary.json.tmp", "report.html.tmp"}) {
    fs::remove_all(at("full"));
    fs::create_directory(at("full"));
    fs::create_symlink("/dev/full", at("full") / file);
    const Outcome outcome = viwo({"run", "run.yaml", "--out", "full"});
    EXPECT_EQ(outcome.code, 1) << file;
    const std::string name = fs::path(file).extension() == ".tmp" ? fs::path(file).stem() : file;
    EXPECT_NE(outcome.err.find("full/" + name), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("No space left on device"), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.out, "") << "claims success";
  }
}

TEST_F(ResultsTest, AreWrittenForARunThatDiverges) {
  write("run.yaml", kRun);
  expect_done({"simulate", "run.yaml", "--out", "log"});
  std::string robot = kRun.substr(kRun.find("      type: four_wis_wid"));
  const std::string radius = "radius_m: 0.025";
  ASSERT_NE(robot.find(radius), std::string::npos);
  robot.replace(robot.find(radius), radius.size(), "radius_m: 1e306");
  write("log.yaml", "sensors:\n  wheels0: {type: asl_encoders, path: log/wheels0}\nkinematics:\n" +
                        robot.substr(0, robot.find("    duration_s")));
  const Outcome outcome = viwo({"run", "log.yaml", "--out", "out"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.out.find("status diverged: "), 0U) << outcome.out;
  EXPECT_EQ(summary().at("status"), "diverged");
  EXPECT_TRUE(fs::exists(at("out/report.html")));
}

TEST_F(ResultsTest, OfTheDeliveredSimulatedConfigurations) {
  expect_done({"run", kConfigFolder + "runs/simulated_swerve.yaml", "--out", "run"});
  EXPECT_EQ(summary("run").at("status"), "ok");
  expect_done({"experiment", kConfigFolder + "experiments/simulated_dead_reckoning.yaml", "--seeds",
               "1", "--out", "demo"});
  const nlohmann::json variants = summary("demo").at("variants");
  for (const char* variant : {"drive_only", "redundant", "redundant_weighted"}) {
    EXPECT_TRUE(variants.contains(variant)) << variant;
  }
  expect_done({"calibrate", kConfigFolder + "calibrations/simulated_swerve.yaml", "--out",
               "calibrated", "--set", "sensors.simulator0.duration_s=20"});
  EXPECT_TRUE(fs::exists(at("calibrated/calibration.yaml")));
}

TEST_F(ResultsTest, OfTheDeliveredConfigurationsForTheRecordings) {
  const fs::path data = fs::path(VIWO_TEST_SHARED_DIR) / "data/4wis4wid";
  if (!fs::exists(data)) GTEST_SKIP() << "the recordings are not here";
  const std::string set = "placeholders.data=" + fs::canonical(data).string();
  expect_done({"run", kConfigFolder + "runs/recording.yaml", "--out", "run", "--set", set});
  expect_done({"run", kConfigFolder + "runs/hybrid.yaml", "--out", "hybrid_run", "--set", set});
  for (const char* name : {"nominal_dead_reckoning", "three_models", "hybrid"}) {
    expect_done({"experiment", kConfigFolder + "experiments/" + name + ".yaml", "--out", name,
                 "--set", set});
  }
  expect_done({"calibrate", kConfigFolder + "calibrations/recordings.yaml", "--out", "calibrated",
               "--set", set});
}

TEST_F(ResultsTest, OfTheDeliveredConfigurationsOfTheFilter) {
  // runs/viwo_log.yaml: FilterTest.
  const std::string shorter = "sensors.simulator0.duration_s=5";
  expect_done({"run", kConfigFolder + "runs/viwo_swerve.yaml", "--out", "run", "--set", shorter});
  EXPECT_EQ(summary("run").at("status"), "ok");
  expect_done({"run", kConfigFolder + "runs/viwo_swerve.yaml", "--out", "pinhole", "--set", shorter,
               "--set", "sensors.simulator0.cameras=" + kConfigFolder + "cameras/pinhole.yaml",
               "--set", "sensors.simulator0.n_cameras=1", "--set",
               "cameras.kalibr=" + kConfigFolder + "cameras/pinhole.yaml"});
  EXPECT_EQ(summary("pinhole").at("status"), "ok");
  expect_done({"experiment", kConfigFolder + "experiments/paper_accuracy.yaml", "--seeds", "1",
               "--out", "paper", "--set", shorter});
  expect_done({"experiment", kConfigFolder + "experiments/drive_only_twist_full.yaml", "--seeds",
               "1", "--out", "lateral", "--set", shorter});
  EXPECT_TRUE(summary("lateral").at("by").at("motion").contains("figure_eight"));
  expect_done({"experiment", kConfigFolder + "experiments/paper_exact.yaml", "--seeds", "1",
               "--out", "exact", "--set", "sensors.simulator0.duration_s=2"});
  EXPECT_EQ(summary("exact").at("variants").at("drive_only").at("runs"), 6);
  expect_done({"experiment", kConfigFolder + "experiments/long_runs.yaml", "--seeds", "1", "--out",
               "long", "--set", "sensors.simulator0.duration_s=5"});
  EXPECT_TRUE(summary("long").at("by").at("motion").contains("mixed"));
  const nlohmann::json variants = summary("paper").at("variants");
  for (const char* variant : {"true_init_calib_on", "true_init_calib_off", "bad_init_calib_on",
                              "bad_init_calib_off", "bad_init_twist_only", "bad_init_drive_only"}) {
    EXPECT_TRUE(variants.contains(variant)) << variant;
  }
}

TEST_F(ResultsTest, OfTheDeliveredConfigurationsForObservability) {
  for (const std::string name :
       {"degenerate_motions", "differential", "ackermann", "skid_steer", "mecanum", "swerve"}) {
    expect_done({"observability", kConfigFolder + "observability/" + name + ".yaml", "--out", name,
                 "--set", "sensors.simulator0.duration_s=2"});
    std::ifstream in(at(name) / "observability.json");
    const auto motions = nlohmann::json::parse(in).at("motions");
    EXPECT_TRUE(motions.contains("general"));
    EXPECT_TRUE(motions.contains("stationary"));
  }
}

TEST_F(ResultsTest, OfTheDeliveredConfigurationsOfOtherBases) {
  const std::string shorter = "sensors.simulator0.duration_s=5";
  const std::map<std::string, std::vector<std::string>> variants{
      {"ackermann", {"rear_and_centre", "all_and_centre", "rear_and_both"}},
      {"skid_steer", {"held_frame", "known_mounting"}},
      {"mecanum", {"twist_only", "full"}},
      {"swerve", {"three_wheels", "four_wheels", "six_wheels"}}};
  for (const auto& [base, names] : variants) {
    const std::string run = "runs/viwo_" + base + ".yaml";
    expect_done({"run", kConfigFolder + run, "--out", base, "--set", shorter});
    EXPECT_EQ(summary(base).at("status"), "ok") << base;
    expect_done({"experiment", kConfigFolder + "experiments/calibrate_" + base + ".yaml", "--seeds",
                 "1", "--out", base + "_experiment", "--set", shorter});
    const nlohmann::json results = summary(base + "_experiment").at("variants");
    EXPECT_EQ(results.size(), names.size()) << base;
    for (const std::string& name : names) EXPECT_EQ(results.at(name).at("runs"), 1) << name;
  }
}

TEST_F(ResultsTest, OfTheDeliveredConfigurationsWithAPoseReference) {
  const std::string shorter = "sensors.simulator0.duration_s=5";
  expect_done({"run", kConfigFolder + "runs/viwo_gnss.yaml", "--out", "run", "--set", shorter});
  EXPECT_EQ(summary("run").at("status"), "ok");
  expect_done({"experiment", kConfigFolder + "experiments/plane_and_gnss.yaml", "--seeds", "1",
               "--out", "experiment", "--set", shorter});
  EXPECT_TRUE(summary("experiment").at("variants").contains("wheels_plane_gnss"));
}

TEST_F(ResultsTest, OfTheDeliveredConfigurationsWithTyres) {
  const std::string shorter = "sensors.simulator0.duration_s=5";
  expect_done({"run", kConfigFolder + "runs/viwo_contact.yaml", "--out", "run", "--set", shorter});
  EXPECT_EQ(summary("run").at("status"), "ok");
  expect_done({"experiment", kConfigFolder + "experiments/contact_physics.yaml", "--seeds", "1",
               "--out", "experiment", "--set", shorter});
  const nlohmann::json variants = summary("experiment").at("variants");
  EXPECT_EQ(variants.size(), 18U);
  for (const auto& variant : variants) EXPECT_EQ(variant.at("runs"), 1);
}

TEST_F(ResultsTest, OfTheDeliveredExperimentWithTwoPairsOfCameras) {
  expect_done({"experiment", kConfigFolder + "experiments/four_cameras.yaml", "--seeds", "1",
               "--out", "cameras", "--set", "sensors.simulator0.duration_s=1.5", "--set",
               "sensors.images0.texture_size_px=512"});
  const nlohmann::json variants = summary("cameras").at("variants");
  EXPECT_EQ(variants.size(), 2U);
  for (const auto& variant : variants) {
    EXPECT_EQ(variant.at("runs"), 1);
    EXPECT_LT(variant.at("metrics").at("ate_m").at("mean").get<double>(), 0.01);
  }
}

TEST_F(ResultsTest, OfTheDeliveredConfigurationForOpenVinsMeasurements) {
  const fs::path data = fs::path(VIWO_TEST_SHARED_DIR) / "data/openvins_sim";
  if (!fs::exists(data)) GTEST_SKIP() << "the measurements are not here";
  const std::string set = "placeholders.data=" + fs::canonical(data).string();
  expect_done({"run", kConfigFolder + "runs/openvins_sim.yaml", "--out", "run", "--set", set});
  // OpenVINS itself: 0.594 deg and 0.144 m.
  const nlohmann::json accuracy = summary("run").at("accuracy");
  EXPECT_LT(accuracy.at("ate_deg").get<double>(), 0.594);
  EXPECT_LT(accuracy.at("ate_m").get<double>(), 0.144);
}

TEST_F(ResultsTest, OfTheDeliveredConfigurationForACalibrationBoard) {
  const fs::path data = fs::path(VIWO_TEST_SHARED_DIR) / "data/real/euroc_imu_april";
  if (!fs::exists(data)) GTEST_SKIP() << "the measurements are not here";
  expect_done({"run", kConfigFolder + "runs/euroc_board.yaml", "--out", "run", "--set",
               "placeholders.data=" + fs::canonical(data).string()});
  const nlohmann::json result = summary("run");
  EXPECT_EQ(result.at("status"), "ok");
  // Of both cameras, which have one clock.
  const nlohmann::json calibration = result.at("calibration");
  EXPECT_EQ(calibration.size(), 2U * 14U + 1U);
  EXPECT_LT(calibration.at("cam0.t_CtoI").at("sigma").get<double>(), 1e-3);
  EXPECT_LT(calibration.at("cam1.fx").at("sigma").get<double>(), 0.5);
}

TEST_F(ResultsTest, AreDoubtfulWhereTheReferenceContradictsThem) {
  write("run.yaml", kRun);
  const Outcome outcome = viwo({"run", "run.yaml", "--out", "out", "--set",
                                "sensors.sim.drive_scale=[57.3, 57.3, 57.3, 57.3]"});
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  EXPECT_EQ(outcome.out.find("status doubtful\n  the reference contradicts the estimate: after "),
            0U)
      << outcome.out;
  EXPECT_EQ(summary().at("status"), "doubtful");
}

TEST_F(ResultsTest, OfTheDeliveredConfigurationForSatelliteFixes) {
  const fs::path data = fs::path(VIWO_TEST_SHARED_DIR) / "data/real";
  if (!fs::exists(data / "husky_bag")) GTEST_SKIP() << "the recording is not here";
  for (const char* plugin : {"update_gnss", "sensor_ros1_bag"}) {
    const std::string file = std::string("libviwo_") + plugin + ".so";
    if (!fs::exists(fs::path(VIWO_TEST_PLUGIN_DIR) / file)) GTEST_SKIP() << file << " is left out";
  }
  expect_done({"run", kConfigFolder + "runs/husky_gnss.yaml", "--out", "run", "--set",
               "placeholders.data=" + fs::canonical(data).string()});
  const nlohmann::json result = summary("run");
  EXPECT_EQ(result.at("status"), "ok");
  EXPECT_LT(result.at("calibration").at("gnss.yaw_EtoG").at("sigma").get<double>(), 0.1);
  // The twist that the bag has is not for wheels.
  const Outcome wheels =
      viwo({"run", kConfigFolder + "runs/husky_gnss.yaml", "--out", "none", "--set",
            "placeholders.data=" + fs::canonical(data).string(), "--set",
            "kinematics={type: differential, radius_left_m: 0.16, radius_right_m: 0.16, "
            "baseline_m: 0.5}"});
  EXPECT_EQ(wheels.code, 2);
  EXPECT_NE(wheels.err.find("drive_joints are the twist of an odometry, but kinematics "
                            "'differential' takes angular velocities of wheels - did you mean "
                            "kinematics: {type: body_twist}?"),
            std::string::npos)
      << wheels.err;
}

TEST_F(ResultsTest, OfTheDeliveredExperimentWithWrongCameras) {
  if (!fs::exists(fs::path(VIWO_TEST_SHARED_DIR) / "data/openvins_sim")) {
    GTEST_SKIP() << "the measurements are not here";
  }
  const Outcome outcome = viwo(
      {"experiment", kConfigFolder + "experiments/openvins_cameras.yaml", "--seeds", "1", "--set",
       "placeholders.data=" +
           fs::canonical(fs::path(VIWO_TEST_SHARED_DIR) / "data/openvins_sim").string(),
       "--out", "cameras"});
  // Estimated, the cameras cost little; held as they are, everything, and that is told.
  EXPECT_NE((outcome.out + outcome.err).find("held_wrong"), std::string::npos) << outcome.out;
  EXPECT_NE((outcome.out + outcome.err).find(" rejected: what it measures and the rest"),
            std::string::npos)
      << outcome.out << outcome.err;
  const nlohmann::json variants = summary("cameras").at("variants");
  const auto ate_m = [&](const char* variant) {
    return variants.at(variant).at("metrics").at("ate_m").at("mean").get<double>();
  };
  EXPECT_LT(ate_m("estimated"), 1.3 * ate_m("exact"));
  EXPECT_GT(ate_m("held_wrong"), 5. * ate_m("exact"));
}

TEST_F(ResultsTest, TheJobFilesOfClustersRunShards) {
  const std::string experiment = kConfigFolder + "experiments/simulated_dead_reckoning.yaml";
  const std::string out = at("campaign").string();
  for (int task = 0; task < 2; ++task) {
    const std::string command =
        "SLURM_ARRAY_TASK_COUNT=2 SLURM_ARRAY_TASK_ID=" + std::to_string(task) + " EXPERIMENT='" +
        experiment + "' OUT='" + out + "' VIWO='" VIWO_TEST_PROGRAM "' sh '" + kConfigFolder +
        "cluster/slurm.sh' > /dev/null 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << task;
  }
  expect_done({"experiment", experiment, "--out", out, "--collect"});
  // What the other one starts, word by word.
  std::ifstream in(kConfigFolder + "cluster/kubernetes.yaml");
  const std::string job{std::istreambuf_iterator<char>(in), {}};
  EXPECT_NE(job.find("[viwo, experiment, configs/experiments/paper_accuracy.yaml, --out,"),
            std::string::npos);
  EXPECT_NE(job.find("--shard, JOB_COMPLETION_INDEX/8]"), std::string::npos);
}

TEST_F(ResultsTest, AllDeliveredConfigurationsAreTriedHere) {
  std::set<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(kConfigFolder)) {
    if (entry.path().extension() == ".yaml") {
      files.insert(fs::relative(entry.path(), kConfigFolder).string());
    }
  }
  EXPECT_EQ(
      files,
      (std::set<std::string>{
          "calibrations/recordings.yaml", "calibrations/simulated_swerve.yaml",
          "calibrations/smoothed_swerve.yaml", "cameras/euroc.yaml", "cameras/kaist_urban.yaml",
          "cameras/pinhole.yaml", "cameras/t265_like.yaml", "cameras/two_pairs.yaml",
          "cluster/kubernetes.yaml", "experiments/calibrate_ackermann.yaml",
          "experiments/calibrate_mecanum.yaml", "experiments/calibrate_skid_steer.yaml",
          "experiments/calibrate_swerve.yaml", "experiments/contact_physics.yaml",
          "experiments/drive_only_twist_full.yaml", "experiments/four_cameras.yaml",
          "experiments/hybrid.yaml", "experiments/images.yaml", "experiments/long_runs.yaml",
          "experiments/nominal_dead_reckoning.yaml", "experiments/openvins_cameras.yaml",
          "experiments/paper_accuracy.yaml", "experiments/paper_exact.yaml",
          "experiments/plane_and_gnss.yaml", "experiments/simulated_dead_reckoning.yaml",
          "experiments/three_models.yaml",
          // by the commands of docs/getting_started.md
          "getting_started/frc.yaml", "getting_started/frc_calibration.yaml",
          "getting_started/own_base.yaml", "getting_started/own_base_calibration.yaml",
          "getting_started/own_base_demo.yaml", "getting_started/swerve_demo.yaml",
          "getting_started/swerve_ros2.yaml", "getting_started/swerve_ros2_calibration.yaml",
          "observability/ackermann.yaml", "observability/mecanum.yaml",
          "observability/skid_steer.yaml", "observability/swerve.yaml",
          "observability/degenerate_motions.yaml", "observability/differential.yaml",
          "plans/swerve.yaml", "plans/swerve_calibration.yaml", "plans/swerve_drive.yaml",
          "runs/comma2k19_car.yaml", "runs/euroc.yaml", "runs/euroc_board.yaml",
          "runs/husky_gnss.yaml", "runs/frc_swerve.yaml", "runs/hybrid.yaml",
          "runs/kaist_urban.yaml", "runs/openvins_sim.yaml", "runs/recording.yaml",
          "runs/simulated_swerve.yaml", "runs/tum_vi.yaml", "runs/ucsd_skid_steer.yaml",
          "runs/viwo_ackermann.yaml", "runs/viwo_bag.yaml", "runs/viwo_contact.yaml",
          "runs/viwo_gnss.yaml", "runs/viwo_images.yaml", "runs/viwo_images_log.yaml",
          "runs/viwo_live.yaml", "runs/viwo_live_ros2.yaml", "runs/viwo_log.yaml",
          "runs/viwo_mecanum.yaml", "runs/viwo_skid_steer.yaml", "runs/viwo_swerve.yaml"}))
      << "name the new file in a test above";
}

}  // namespace
}  // namespace viwo
