// The filter as a user meets it: what its sections may say, how a run of it ends, and that a log
// plays back to the same bits.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <thread>

#include "../live/child.hpp"
#include "support.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

/// A simulated robot with a camera that drives a circle for five seconds. Line numbers matter.
const std::string kVio =
    "name: small\n"                           // 1
    "sensors:\n"                              // 2
    "  sim:\n"                                // 3
    "    type: simulator\n"                   // 4
    "    robot: &robot\n"                     // 5
    "      type: four_wis_wid\n"              // 6
    "      x_m: [0.1, -0.1, -0.1, 0.1]\n"     // 7
    "      y_m: [0.1, 0.1, -0.1, -0.1]\n"     // 8
    "      radius_m: 0.025\n"                 // 9
    "      sigma_drive_rad_per_s: 0.001\n"    // 10
    "    duration_s: 5\n"                     // 11
    "    motion: circle\n"                    // 12
    "    cameras: cam.yaml\n"                 // 13
    "    features: 50\n"                      // 14
    "kinematics: *robot\n"                    // 15
    "cameras: {kalibr: cam.yaml}\n"           // 16
    "imu: {}\n"                               // 17
    "wheels: {t_OtoI_s: 0}\n"                 // 18
    "estimator: {clones: 11}\n"               // 19
    "updates:\n"                              // 20
    "  visual_features: {}\n"                 // 21
    "  wheel_odometry: {max_bridged_s: 1}\n"  // 22
    "  wheel_parity: {}\n";                   // 23

const std::string kConfigs = std::string(VIWO_TEST_SOURCE_DIR) + "/configs/";

class FilterTest : public CommandLineTest {
 protected:
  void SetUp() override {
    fs::copy_file(kConfigs + "cameras/pinhole.yaml", at("cam.yaml"));
    write("run.yaml", kVio);
  }

  void change(const std::string& from, const std::string& to) const {
    ASSERT_NE(kVio.find(from), std::string::npos) << from;
    write("run.yaml", replaced(kVio, from, to));
  }

  /// The run with one thing changed is refused with this message.
  void refuse(const std::string& from, const std::string& to, const std::string& message) const {
    SCOPED_TRACE(to);
    change(from, to);
    expect_refused({"run", "run.yaml", "--out", "out"}, message);
  }

  inline static const std::string kSearched =
      std::string(" (searched ") + VIWO_TEST_PLUGIN_DIR + ")";
};

TEST_F(FilterTest, RunsAndReportsWhatItUsed) {
  const Outcome outcome = expect_done({"run", "run.yaml", "--out", "out"});
  EXPECT_EQ(outcome.err, "");  // a short run says nothing of its progress
  EXPECT_EQ(outcome.out.find("status ok\n"), 0U) << outcome.out;
  const nlohmann::json result = summary();
  EXPECT_EQ(result.at("epochs"), 50);
  for (const char* update : {"visual_features", "wheel_odometry", "wheel_parity"}) {
    EXPECT_TRUE(result.at("updates").contains(update)) << update;
    EXPECT_TRUE(result.at("timing_ms").contains(update)) << update;
  }
  EXPECT_LT(result.at("accuracy").at("end").at("m").get<double>(), 0.1);
}

TEST_F(FilterTest, RunsFromItsOwnResolvedConfigurationToTheSameBits) {
  expect_done({"run", "run.yaml", "--out", "out"});
  expect_done({"run", "out/config.resolved.yaml", "--out", "again"});
  EXPECT_EQ(read("out/trajectory.tum"), read("again/trajectory.tum"));
  EXPECT_EQ(read("out/calibration.csv"), read("again/calibration.csv"));
  EXPECT_EQ(read("out/config.resolved.yaml"), read("again/config.resolved.yaml"));
}

TEST_F(FilterTest, RefusesUpdatesThatAreNone) {
  refuse("visual_features:", "visual_featurs:",
         "run.yaml:21:3  updates.visual_featurs.type: no update plugin 'visual_featurs' - did you "
         "mean 'visual_features'?" +
             kSearched);
  refuse("visual_features: {}", "eyes: {type: visual_faetures}",
         "run.yaml:21:16  updates.eyes.type: no update plugin 'visual_faetures' - did you mean "
         "'visual_features'?" +
             kSearched);
  refuse("visual_features: {}", "visual_features: 3",
         "run.yaml:21:20  updates.visual_features must be a section of parameters ({} for none)");
  refuse("visual_features: {}", "visual_features: {enabled: maybe}",
         "run.yaml:21:30  updates.visual_features.enabled must be true or false");
  refuse("visual_features: {}", "visual_features: {sigma_pix: 1}",
         "run.yaml:21:21  updates.visual_features (visual_features): unknown key 'sigma_pix' - did "
         "you mean 'sigma_px'?");
  refuse(kVio.substr(kVio.find("updates")), "updates: 3\n",
         "run.yaml:20:10  'updates' is a section NAME: {its parameters}");
  refuse(
      "updates:", "update:", "run.yaml:20:1  run: unknown key 'update' - did you mean 'updates'?");
}

TEST_F(FilterTest, RefusesUnknownKeysInEachSection) {
  refuse("cam.yaml}", "cam.yaml, sigma_orientation: 1}",
         "run.yaml:16:29  cameras: unknown key 'sigma_orientation' - sigma_orientation is in rad, "
         "did you mean 'sigma_orientation_rad'?");
  refuse("imu: {}", "imu: {kalbr: x}",
         "run.yaml:17:7  imu: unknown key 'kalbr' - did you mean 'kalibr'?");
  refuse("t_OtoI_s", "t_OtoI",
         "run.yaml:18:10  wheels: unknown key 't_OtoI' - t_OtoI is in s, did you mean 't_OtoI_s'?");
  refuse("clones", "clone",
         "run.yaml:19:13  estimator: unknown key 'clone' - did you mean 'clones'?");
  refuse("{}\n  wheel_odometry",
         "{}\nwheel_sets: {more: {kinematics: *robot, wheel: {}}}\nupdates2:\n"
         "  wheel_odometry",
         "run.yaml:22:41  wheel_sets.more: unknown key 'wheel' - known: kinematics, wheels\n"
         "run.yaml:23:1  run: unknown key 'updates2' - did you mean 'updates'?");
}

TEST_F(FilterTest, RefusesWrongValuesInEachSection) {
  refuse("imu: {}", "imu: 3",
         "run.yaml:17:6  imu: expected a section (lines of 'key: value'), got a single value");
  refuse(
      "t_OtoI_s: 0", "p_IinO_m: [1, 2]",
      "run.yaml:18:20  wheels.p_IinO_m: needs 3 numbers, not 2 (origin of the IMU in the odometry "
      "frame O, m)");
  refuse("clones: 11", "clones: 1",
         "run.yaml:19:21  estimator.clones: 1 violates 2 <= clones <= 100 (past poses kept in the "
         "state)");
  refuse("clones: 11", "type: kalman",
         "run.yaml:19:19  estimator.type: unknown value 'kalman' - known: auto, msckf, "
         "dead_reckoning");
  // Also when the filter is not asked for.
  refuse("clones: 11", "type: dead_reckoning, clone: 3",
         "run.yaml:19:35  estimator: unknown key 'clone' - did you mean 'clones'?");
}

TEST_F(FilterTest, TakesTheNoisesOfTheImuFromAFileOrAsNumbers) {
  write("imu.yaml",
        "imu0: {gyroscope_noise_density: 1.25e-4, gyroscope_random_walk: 0,\n"
        "  accelerometer_noise_density: 0.0017, accelerometer_random_walk: 0.003}\n");
  refuse("imu: {}", "imu: {kalibr: imu.yaml, sigma_gyro_rad_per_s_sqrt_hz: 1e-3}",
         "run.yaml:17:25  imu.sigma_gyro_rad_per_s_sqrt_hz: imu.kalibr gives it, too - write "
         "either");
  change("imu: {}", "imu: {kalibr: imu.yaml}");
  expect_done({"run", "run.yaml", "--out", "out"});
  const std::string resolved = read("out/config.resolved.yaml");
  EXPECT_NE(resolved.find("sigma_gyro_rad_per_s_sqrt_hz: 0.000125\n"), std::string::npos)
      << resolved;
  fs::remove(at("imu.yaml"));
  expect_done({"run", "out/config.resolved.yaml", "--out", "again"});
  EXPECT_EQ(read("out/trajectory.tum"), read("again/trajectory.tum"));
  EXPECT_EQ(resolved, read("again/config.resolved.yaml"));
}

TEST_F(FilterTest, RefusesCamerasThatAreNotThere) {
  refuse(
      "{kalibr: cam.yaml}", "{kalibr: none.yaml}",
      "run.yaml:16:19  cameras.kalibr: TMP/none.yaml  cannot be read: No such file or directory");
  refuse("cam.yaml}", "cam.yaml, use: 3}",
         "run.yaml:16:34  cameras.use: there are only 1 in TMP/cam.yaml");
  refuse("{kalibr: cam.yaml}", "{}",
         "run.yaml:16:10  cameras: 'kalibr' is missing (Kalibr camera chain; feature tracks name "
         "cameras by their place in it)");
  refuse("imu: {}", "imu: {kalibr: none.yaml}",
         "run.yaml:17:15  imu.kalibr: TMP/none.yaml  cannot be read: No such file or directory");
  refuse("cameras: {kalibr: cam.yaml}\n", "\n",
         "run.yaml:21:3  updates.visual_features: needs a camera: there is no section 'cameras'");
}

TEST_F(FilterTest, RefusesAnUpdateWhoseSensorGivesNoPoses) {
  refuse("wheel_parity: {}", "fix: {type: pose_reference, sensor: sim, sigma_position_m: 0.01}",
         "run.yaml:3:3  sensor 'sim' gives no poses, which fix needs");
  refuse("wheel_parity: {}", "fix: {type: pose_reference, sigma_position_m: 0.01}",
         "run.yaml:3:3  fix needs the sensor that gives its poses (sensor: NAME)");
  refuse("wheel_parity: {}", "wheel_parity: {sensor: simm}",
         "run.yaml:23:26  updates.wheel_parity.sensor: no sensor 'simm' - did you mean 'sim'?");
}

TEST_F(FilterTest, RefusesUpdatesOfWheelsThatAreNotThere) {
  refuse("kinematics: *robot\n", "\n",
         "run.yaml:22:3  updates.wheel_odometry: needs wheels: there is no section 'kinematics'\n"
         "run.yaml:23:3  updates.wheel_parity: needs wheels: there is no section 'kinematics'");
  refuse("t_OtoI_s: 0", "sensor: simm",
         "run.yaml:18:18  wheels.sensor: no sensor 'simm' - did you mean 'sim'?");
  refuse("kinematics: *robot",
         "kinematics: {type: four_wis_wid, x_m: [0.1, -0.1], y_m: [0.1, 0.1], radius_m: 0.02}",
         "run.yaml:15:13  sensors.sim has 4 drive and 4 steering channels, but the kinematic model "
         "has 2 driven and 2 steered wheels");
}

TEST_F(FilterTest, RefusesFurtherWheelsWhoseSensorDoesNotFit) {
  expect_done({"simulate", "run.yaml", "--out", "log"});
  write("run.yaml", replaced(replaced(kVio, "t_OtoI_s: 0", "sensor: sim"), "kinematics: *robot\n",
                             "  back: {type: asl_encoders, path: log/wheels0}\n"
                             "kinematics: *robot\n"
                             "wheel_sets:\n"
                             "  back:\n"
                             "    wheels: {sensor: back}\n"
                             "    kinematics: {type: differential, radius_left_m: 0.02, "
                             "radius_right_m: 0.02, baseline_m: 0.2}\n"));
  expect_refused(
      {"run", "run.yaml", "--out", "out"},
      "run.yaml:3:3  sensors.back has 4 drive and 4 steering channels, but the kinematic "
      "model has 2 driven and 0 steered wheels");
}

TEST_F(FilterTest, RefusesToRunWithoutTheMeasurementsItNeeds) {
  expect_done({"simulate", "run.yaml", "--out", "log"});
  const std::string from = kVio.substr(0, kVio.find("kinematics"));
  const std::string robot =
      "kinematics:\n" + kVio.substr(kVio.find("      type: four"),
                                    kVio.find("    duration_s") - kVio.find("      type: four"));
  const std::string images = "sensors:\n  images: {type: asl_features, path: log/features0}\n";
  const std::string rest = robot + replaced(kVio, from + "kinematics: *robot\n", "");
  write("run.yaml", images + rest);
  expect_refused(
      {"run", "run.yaml", "--out", "out"},
      "run.yaml:2:3  no sensor of this run gives imu, which the filter needs\n"
      "run.yaml:2:3  no sensor of this run gives encoders, which wheel_odometry, wheel_parity "
      "needs");
  write("run.yaml", images +
                        "  imu: {type: asl_imu, path: log/imu0}\n"
                        "  wheels: {type: asl_encoders, path: log/wheels0}\n" +
                        rest);
  expect_refused(
      {"run", "run.yaml", "--out", "out"},
      "run.yaml:2:3  no sensor of this run gave reference states, which estimator.start: "
      "reference needs - choose start: standstill or moving");
}

TEST_F(FilterTest, EndsADivergingRunWithEpochAndCause) {
  change("imu: {}", "imu: {sigma_gyro_rad_per_s_sqrt_hz: 1e200}");
  const Outcome outcome = viwo({"run", "run.yaml", "--out", "out"});
  EXPECT_EQ(outcome.code, 1);
  const std::string cause =
      "the estimate or its covariance is not finite any more (epoch 1, 0.000000 s)";
  EXPECT_EQ(outcome.out.find("status diverged: " + cause + "\n"), 0U) << outcome.out;
  EXPECT_EQ(summary().at("status"), "diverged");
  EXPECT_EQ(summary().at("cause"), cause);
  EXPECT_TRUE(fs::exists(at("out/report.html")));
}

TEST_F(FilterTest, SaysThatItFoundNoStateToStartFrom) {
  change("clones: 11", "start: standstill");  // but the base drives all the time
  const Outcome outcome = viwo({"run", "run.yaml", "--out", "out"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.out.find("status failed: no state to start from was found in the measurements: "
                             "a wheel turns faster than 0.05 rad/s ("),
            0U)
      << outcome.out;
  EXPECT_NE(outcome.out.find(" attempts) - choose start: moving, or reference\n"),
            std::string::npos)
      << outcome.out;
}

TEST_F(FilterTest, WarnsWhenSensorAndFilterKnowOtherCameras) {
  EXPECT_EQ(expect_done({"run", "run.yaml", "--out", "same"}).out.find("warning"),
            std::string::npos);
  // The same in other words: no difference.
  const std::string chain = read("cam.yaml");
  write("other.yaml", "# a copy\n" + chain);
  change("{kalibr: cam.yaml}", "{kalibr: other.yaml}");
  EXPECT_EQ(expect_done({"run", "run.yaml", "--out", "copy"}).out.find("warning"),
            std::string::npos);
  write("other.yaml", replaced(chain, "intrinsics: [", "intrinsics: [1"));
  const Outcome outcome = viwo({"run", "run.yaml", "--out", "out"});
  const std::string warning = summary().at("warnings").at(0);
  EXPECT_EQ(warning.find("sensors.sim.cameras and cameras.kalibr differ: fx [px] of cam0 is "), 0U)
      << warning;
  EXPECT_NE(outcome.out.find("warning: " + warning + "\n"), std::string::npos) << outcome.out;
  EXPECT_NE(read("out/report.html").find(warning), std::string::npos);
}

TEST_F(FilterTest, CountsWhatItSimulates) {
  // 200 Hz, 100 Hz and 10 Hz for five seconds, both ends included; 16 intrinsics, 6 of the mounting
  // and a time offset.
  EXPECT_EQ(
      expect_done({"simulate", "run.yaml", "--out", "log"}).out,
      "1001 IMU samples, 50 tracked images, 501 encoder samples, 51 reference states and 38 true "
      "parameters in log\n");
  write("run.yaml", kRun);
  EXPECT_EQ(expect_done({"simulate", "run.yaml", "--out", "log"}).out,
            "501 encoder samples and 501 reference poses in log\n");
  EXPECT_FALSE(fs::exists(at("log/imu0"))) << "a table of the earlier log";
}

TEST_F(FilterTest, RunsFromALogToTheSameBits) {
  const std::string run = kConfigs + "runs/viwo_swerve.yaml";
  const std::string set = "sensors.simulator0.duration_s=10";
  expect_done({"run", run, "--set", set, "--out", "direct"});
  expect_done({"simulate", run, "--set", set, "--out", "log"});
  expect_done({"run", kConfigs + "runs/viwo_log.yaml", "--set",
               "placeholders.log=" + at("log").string(), "--out", "from_log"});
  for (const char* file : {"/trajectory.tum", "/reference.tum", "/calibration.csv"}) {
    EXPECT_EQ(read(std::string("direct") + file), read(std::string("from_log") + file)) << file;
  }
  EXPECT_EQ(summary("direct").at("updates"), summary("from_log").at("updates"));
}

/// The first sign of its progress is after a second.
TEST_F(FilterTest, WritesWhatItHasWhenItIsInterrupted) {
  const std::string printed = at("printed").string();
  testing::Child viwo({VIWO_TEST_PROGRAM, "run", kConfigs + "runs/viwo_swerve.yaml", "--set",
                       "sensors.simulator0.duration_s=600", "--out", at("out").string()},
                      printed);
  write("printed", "");
  for (int i = 0; i < 6000 && read("printed").find(" %\n") == std::string::npos; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  viwo.signal(SIGINT);
  ASSERT_EQ(viwo.wait(std::chrono::seconds(60)), 0) << read("printed");
  const nlohmann::json json = summary();
  EXPECT_EQ(json.at("status"), "ok");
  const double duration_s = json.at("duration_s").get<double>();
  EXPECT_GT(duration_s, 50.);
  EXPECT_LT(duration_s, 599.);
  char said[120];
  std::snprintf(said, sizeof said,
                "interrupted at t = %.3f s: the rest of the recording was not used", duration_s);
  EXPECT_EQ(json.at("warnings").front(), said);
  const std::string trajectory = read("out/trajectory.tum");
  EXPECT_EQ(std::count(trajectory.begin(), trajectory.end(), '\n'),
            1 + json.at("epochs").get<int>())
      << "a line for each, and the names of the columns";
}

TEST_F(FilterTest, IsListedAndDescribedWithItsUpdates) {
  const std::string list = expect_done({"plugins", "list"}).out;
  for (const char* update :
       {"visual_features", "wheel_odometry", "wheel_parity", "zero_velocity"}) {
    EXPECT_NE(list.find(std::string("update  ") + update + "  "), std::string::npos) << update;
    const std::string text = expect_done({"plugins", "describe", update}).out;
    EXPECT_EQ(text.find(std::string("# update ") + update + " "), 0U) << text;
    EXPECT_NE(text.find(std::string("\ntype: ") + update + "\n"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace viwo
