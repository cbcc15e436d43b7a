// Every configuration that is delivered runs, shortened where it takes long, and ends as it says.
#include <map>
#include <set>

#include "support.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

using DeliveredTest = CommandLineTest;

const std::string kConfigFolder = std::string(VIWO_TEST_SOURCE_DIR) + "/configs/";

TEST_F(DeliveredTest, SimulatedConfigurations) {
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

class DeliveredForTheRecordingsTest : public DeliveredTest {
 protected:
  void SetUp() override {
    const fs::path data = fs::path(VIWO_TEST_SHARED_DIR) / "data/4wis4wid";
    if (!fs::exists(data)) GTEST_SKIP() << "the recordings are not here";
    set_ = "placeholders.data=" + fs::canonical(data).string();
  }
  std::string set_;
};

TEST_F(DeliveredForTheRecordingsTest, Configurations) {
  expect_done({"run", kConfigFolder + "runs/recording.yaml", "--out", "run", "--set", set_});
  expect_done({"run", kConfigFolder + "runs/hybrid.yaml", "--out", "hybrid_run", "--set", set_});
  for (const char* name : {"nominal_dead_reckoning", "three_models"}) {
    expect_done({"experiment", kConfigFolder + "experiments/" + name + ".yaml", "--out", name,
                 "--set", set_});
  }
}

TEST_F(DeliveredForTheRecordingsTest, ExperimentWithSimulatedCameras) {
  expect_done({"experiment", kConfigFolder + "experiments/hybrid.yaml", "--seeds", "1", "--out",
               "hybrid", "--set", set_});
}

// Without those left out: framework/calibration/tests/test_recordings.cpp does it as delivered.
TEST_F(DeliveredForTheRecordingsTest, Calibration) {
  const std::string config = testing::text_of(kConfigFolder + "calibrations/recordings.yaml");
  const std::string fewer =
      replaced(config, "leave_out_by: [repetition, motion]\n", "leave_out_by: []\n");
  ASSERT_LT(fewer.size(), config.size());
  write("calibrations/recordings.yaml", replaced(fewer, "../runs/", kConfigFolder + "runs/"));
  expect_done({"calibrate", "calibrations/recordings.yaml", "--out", "calibrated", "--set", set_});
}

TEST_F(DeliveredTest, ConfigurationsOfTheFilter) {
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
  expect_done({"experiment", kConfigFolder + "experiments/far_from_nominal.yaml", "--seeds", "1",
               "--out", "far", "--set", "sensors.simulator0.duration_s=5"});
  expect_done({"experiment", kConfigFolder + "experiments/long_runs.yaml", "--seeds", "1", "--out",
               "long", "--set", "sensors.simulator0.duration_s=5"});
  expect_done({"experiment", kConfigFolder + "experiments/rough_starts.yaml", "--seeds", "1",
               "--out", "rough", "--set", "sensors.simulator0.duration_s=5"});
  EXPECT_TRUE(summary("long").at("by").at("motion").contains("mixed"));
  const nlohmann::json variants = summary("paper").at("variants");
  for (const char* variant : {"true_init_calib_on", "true_init_calib_off", "bad_init_calib_on",
                              "bad_init_calib_off", "bad_init_twist_only", "bad_init_drive_only"}) {
    EXPECT_TRUE(variants.contains(variant)) << variant;
  }
}

TEST_F(DeliveredTest, ConfigurationsForObservability) {
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

TEST_F(DeliveredTest, ConfigurationsOfOtherBases) {
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

TEST_F(DeliveredTest, ConfigurationsWithAPoseReference) {
  const std::string shorter = "sensors.simulator0.duration_s=5";
  expect_done({"run", kConfigFolder + "runs/viwo_gnss.yaml", "--out", "run", "--set", shorter});
  EXPECT_EQ(summary("run").at("status"), "ok");
  expect_done({"experiment", kConfigFolder + "experiments/plane_and_gnss.yaml", "--seeds", "1",
               "--out", "experiment", "--set", shorter});
  EXPECT_TRUE(summary("experiment").at("variants").contains("wheels_plane_gnss"));
}

TEST_F(DeliveredTest, ConfigurationsWithTyres) {
  const std::string shorter = "sensors.simulator0.duration_s=5";
  expect_done({"run", kConfigFolder + "runs/viwo_contact.yaml", "--out", "run", "--set", shorter});
  EXPECT_EQ(summary("run").at("status"), "ok");
  expect_done({"experiment", kConfigFolder + "experiments/contact_physics.yaml", "--seeds", "1",
               "--out", "experiment", "--set", shorter});
  const nlohmann::json variants = summary("experiment").at("variants");
  EXPECT_EQ(variants.size(), 20U);
  for (const auto& variant : variants) EXPECT_EQ(variant.at("runs"), 1);
}

/// Experiments on rendered images, for a second and a half.
class DeliveredWithImagesTest : public DeliveredTest {
 protected:
  nlohmann::json variants_of(const std::string& experiment) {
    expect_done({"experiment", kConfigFolder + "experiments/" + experiment + ".yaml", "--seeds",
                 "1", "--out", experiment, "--set", "sensors.simulator0.duration_s=1.5", "--set",
                 "sensors.images0.texture_size_px=512"});
    return summary(experiment).at("variants");
  }
  static double mean(const nlohmann::json& variant, const char* metric) {
    return variant.at("metrics").at(metric).at("mean").get<double>();
  }
};

TEST_F(DeliveredWithImagesTest, TwoPairsOfCameras) {
  const nlohmann::json variants = variants_of("four_cameras");
  EXPECT_EQ(variants.size(), 2U);
  for (const auto& variant : variants) {
    EXPECT_EQ(variant.at("runs"), 1);
    EXPECT_LT(mean(variant, "ate_m"), 0.01);
  }
}

TEST_F(DeliveredWithImagesTest, RollingShutters) {
  const nlohmann::json variants = variants_of("rolling_shutter");
  ASSERT_EQ(variants.size(), 3U);
  const auto &global = variants.at("global"), &rolling = variants.at("rolling");
  EXPECT_LT(mean(rolling, "ate_m"), 1.2 * mean(global, "ate_m"));
  EXPECT_LT(mean(rolling, "nees_relative"), 1.2 * mean(global, "nees_relative"));
  EXPECT_GT(mean(variants.at("not_known"), "nees_relative"), 3. * mean(global, "nees_relative"));
}

TEST_F(DeliveredTest, ConfigurationForOpenVinsMeasurements) {
  const fs::path data = fs::path(VIWO_TEST_SHARED_DIR) / "data/openvins_sim";
  if (!fs::exists(data)) GTEST_SKIP() << "the measurements are not here";
  const std::string set = "placeholders.data=" + fs::canonical(data).string();
  expect_done({"run", kConfigFolder + "runs/openvins_sim.yaml", "--out", "run", "--set", set});
  // OpenVINS itself: 0.594 deg and 0.144 m.
  const nlohmann::json accuracy = summary("run").at("accuracy");
  EXPECT_LT(accuracy.at("ate_deg").get<double>(), 0.594);
  EXPECT_LT(accuracy.at("ate_m").get<double>(), 0.144);
}

TEST_F(DeliveredTest, ConfigurationForACalibrationBoard) {
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

TEST_F(DeliveredTest, ConfigurationForSatelliteFixes) {
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

TEST_F(DeliveredTest, ExperimentWithWrongCameras) {
  if (!fs::exists(fs::path(VIWO_TEST_SHARED_DIR) / "data/openvins_sim")) {
    GTEST_SKIP() << "the measurements are not here";
  }
  const auto experiment = [this](const std::string& relative) {
    return viwo({"experiment", kConfigFolder + "experiments/openvins_cameras.yaml", "--seeds", "1",
                 "--set",
                 "placeholders.data=" +
                     fs::canonical(fs::path(VIWO_TEST_SHARED_DIR) / "data/openvins_sim").string(),
                 "--set", "cameras.relative=" + relative, "--out", "cameras" + relative});
  };
  // Estimated, the cameras cost little; held as they are, everything.
  EXPECT_EQ(experiment("0.1").code, 0);
  const nlohmann::json variants = summary("cameras0.1").at("variants");
  const auto ate_m = [&](const char* variant) {
    return variants.at(variant).at("metrics").at("ate_m").at("mean").get<double>();
  };
  EXPECT_LT(ate_m("estimated"), 1.3 * ate_m("exact"));
  EXPECT_GT(ate_m("held_wrong"), 5. * ate_m("exact"));
  // A pair that contradicts itself is told.
  const Outcome outcome = experiment("1");
  EXPECT_NE((outcome.out + outcome.err).find(" rejected: what it measures and the rest"),
            std::string::npos)
      << outcome.out << outcome.err;
}

TEST_F(DeliveredTest, TheJobFilesOfClustersRunShards) {
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
  const std::string job = testing::text_of(kConfigFolder + "cluster/kubernetes.yaml");
  EXPECT_NE(job.find("[viwo, experiment, /usr/share/viwo/configs/experiments/paper_accuracy.yaml,"),
            std::string::npos);
  EXPECT_NE(job.find("--shard, JOB_COMPLETION_INDEX/8]"), std::string::npos);
}

TEST_F(DeliveredTest, AllConfigurationsAreTriedHere) {
  std::set<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(kConfigFolder)) {
    if (entry.path().extension() == ".yaml") {
      files.insert(fs::relative(entry.path(), kConfigFolder).string());
    }
  }
  EXPECT_EQ(files,
            (std::set<std::string>{
                "calibrations/recordings.yaml", "calibrations/simulated_swerve.yaml",
                "calibrations/smoothed_swerve.yaml", "cameras/euroc.yaml",
                "cameras/kaist_urban.yaml", "cameras/pinhole.yaml", "cameras/rolling_shutter.yaml",
                "cameras/t265_like.yaml", "cameras/two_pairs.yaml", "cluster/kubernetes.yaml",
                "experiments/calibrate_ackermann.yaml", "experiments/calibrate_mecanum.yaml",
                "experiments/calibrate_skid_steer.yaml", "experiments/calibrate_swerve.yaml",
                "experiments/contact_physics.yaml", "experiments/drive_only_twist_full.yaml",
                "experiments/far_from_nominal.yaml", "experiments/four_cameras.yaml",
                "experiments/hybrid.yaml", "experiments/images.yaml", "experiments/long_runs.yaml",
                "experiments/nominal_dead_reckoning.yaml", "experiments/openvins_cameras.yaml",
                "experiments/paper_accuracy.yaml", "experiments/paper_exact.yaml",
                "experiments/plane_and_gnss.yaml", "experiments/rolling_shutter.yaml",
                "experiments/rough_starts.yaml", "experiments/simulated_dead_reckoning.yaml",
                "experiments/three_models.yaml",
                // by the commands of docs/getting_started.md
                "getting_started/camera_imu.yaml", "getting_started/frc.yaml",
                "getting_started/frc_calibration.yaml", "getting_started/own_base.yaml",
                "getting_started/own_base_calibration.yaml", "getting_started/own_base_demo.yaml",
                "getting_started/swerve_demo.yaml", "getting_started/swerve_ros2.yaml",
                "getting_started/swerve_ros2_calibration.yaml", "observability/ackermann.yaml",
                "observability/mecanum.yaml", "observability/skid_steer.yaml",
                "observability/swerve.yaml", "observability/degenerate_motions.yaml",
                "observability/differential.yaml", "plans/swerve.yaml",
                "plans/swerve_calibration.yaml", "plans/swerve_drive.yaml",
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
