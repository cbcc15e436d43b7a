// One run: configuration errors, dead reckoning of a simulated robot, consistency, files.
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "message_of.hpp"
#include "sensors_in_memory.hpp"
#include "simulated.hpp"
#include "viwo/eval/consistency.hpp"
#include "viwo/log/tum.hpp"
#include "viwo/results/run_output.hpp"
#include "viwo/run/simulate.hpp"

namespace viwo {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using testing::error_of;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::registry;
using testing::simulated;

std::filesystem::path fresh_folder(const std::string& name) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / ("viwo_" + name);
  std::filesystem::remove_all(folder);
  return folder;
}

TEST(RunConfiguration, ReportsEverythingThatIsWrongAtOnce) {
  const config::Node run = config::parse(
      "kinematic: {}\nodometry: {twist: weighted, epoch_s: -1}\nsensors: {a: {type: "
      "planar_simulatr}}\n",
      "run.yaml");
  const std::string text = error_of([&] { read_run(run, registry()); });
  EXPECT_THAT(text, HasSubstr("run.yaml:1:1  run: unknown key 'kinematic' - did you mean "
                              "'kinematics'?"));
  EXPECT_THAT(text, HasSubstr("'kinematics' is missing: the section of the kinematic model"));
  EXPECT_THAT(text,
              HasSubstr("run.yaml:2:19  odometry.twist: unknown value 'weighted' - known: auto, "
                        "plain, noise_weighted"));
  EXPECT_THAT(text, HasSubstr("odometry.epoch_s: -1 violates epoch_s >= 0.001"));
  EXPECT_THAT(text, HasSubstr("did you mean 'planar_simulator'?"));
}

TEST(RunConfiguration, NamesBothCountsWhenTheRobotHasOtherWheels) {
  const auto run = simulated(
      "circle", {"kinematics={type: four_wis_wid, x_m: [0.1, -0.1, 0], y_m: [0.1, 0.1, -0.1], "
                 "radius_m: 0.0255}"});
  auto setup = read_run(run, registry());
  EXPECT_EQ(error_of([&] { collect(setup); }),
            "--set kinematics  sensors.simulator0 has 4 drive and 4 steering channels, but the "
            "kinematic model has 3 "
            "driven and 3 steered wheels");
}

TEST(RunConfiguration, TakesEncoderSamplesFromOneSensor) {
  auto run = simulated("circle");
  run.find("sensors")->set("other", *run.at_path("sensors.simulator0"));
  EXPECT_EQ(error_of([&] { read_run(run, registry()); }),
            "run.yaml:2:3  both 'simulator0' and 'other' give encoders: a run takes them from one "
            "sensor - name it: wheels.sensor: NAME\n"
            "run.yaml:2:3  both 'simulator0' and 'other' give poses: a run takes them from one "
            "sensor as reference");
}

TEST(RunConfiguration, ItsResolvedFormIsAConfigurationWithTheSameResult) {
  const auto run = simulated("icr_sweep", {"odometry.epoch_s=0.2"});
  const RunSetup setup = read_run(run, registry(), 7);
  const auto resolved = config::parse(config::to_yaml(setup.resolved), "resolved.yaml");
  const RunSetup again = read_run(resolved, registry());
  EXPECT_EQ(config::to_yaml(again.resolved), config::to_yaml(setup.resolved));
  EXPECT_EQ(again.seed, 7u);
}

TEST(RunConfiguration, RefusesACalibrationOfAnotherModelOrWithMissingEntries) {
  const auto folder = fresh_folder("calibrations");
  std::filesystem::create_directories(folder);
  const auto file = folder / "calibration.yaml";
  const auto run = simulated("circle", {"kinematics.calibration=" + file.string()});
  std::ofstream(file) << "model: differential\ntwist: plain\nintrinsics: {}\n";
  EXPECT_EQ(error_of([&] { read_run(run, registry()); }),
            file.string() +
                ":1:8  this calibration is for the model 'differential', the run has "
                "'four_wis_wid'");
  std::ofstream(file) << "model: four_wis_wid\ntwist: plain\nintrinsics:\n"
                         "  r1: {estimate: 0.025, sigma: 0.001}\n";
  const std::string text = error_of([&] { read_run(run, registry()); });
  EXPECT_THAT(text, HasSubstr(":4:3  the model 'four_wis_wid' has no intrinsic 'r1' - did you mean "
                              "'r_1'?"));
  EXPECT_THAT(text, HasSubstr("intrinsic 'delta_o4' is missing"));
}

TEST(Run, FollowsANoiseFreeRobotExactly) {
  for (const char* motion :
       {"icr_sweep", "straight", "lateral", "circle", "stationary", "figure_eight", "spin"}) {
    for (const char* twist : {"plain", "noise_weighted"}) {
      const auto result = testing::run(simulated(
          motion, {"sensors.simulator0.noise=false", std::string("odometry.twist=") + twist}));
      ASSERT_EQ(result.status, RunStatus::kOk);
      ASSERT_TRUE(result.accuracy) << motion;
      // What is left is the discretisation of 100 Hz samples.
      EXPECT_LT(result.accuracy->end_m, 1e-3) << motion;
      EXPECT_LT(std::abs(result.accuracy->end_yaw_deg), 0.01) << motion;
    }
  }
}

TEST(Run, OfADifferentialDriveFollowsItsOwnMotion) {
  const auto run = config::parse(
      "sensors: {s: {type: planar_simulator, motion: figure_eight, duration_s: 20, noise: false, "
      "robot: &robot {type: differential, radius_left_m: 0.05, radius_right_m: 0.051, baseline_m: "
      "0.3}}}\nkinematics: *robot\n",
      "run.yaml");
  const auto result = testing::run(run);
  EXPECT_LT(result.accuracy->end_m, 1e-3);
}

TEST(Run, IsConsistentWithItsNoiseAndWithTheUncertaintyOfItsIntrinsics) {
  // Small priors, so that first order is enough; the mean over the epochs of a run has expectation
  // 3 whatever their correlation. Two-sided 99.9 % bounds for runs that are one number each.
  const int runs = 60;
  const auto configuration = simulated(
      "icr_sweep",
      {"odometry.twist=plain", "odometry.epoch_s=20", "sensors.simulator0.true_intrinsics_scale=1",
       "sensors.simulator0.robot.prior_sigma_position_m=0.0001",
       "sensors.simulator0.robot.prior_sigma_radius_m=0.00001",
       "sensors.simulator0.robot.prior_sigma_steer_offset_rad=0.0003",
       "kinematics.prior_sigma_position_m=0.0001", "kinematics.prior_sigma_radius_m=0.00001",
       "kinematics.prior_sigma_steer_offset_rad=0.0003"});
  const auto mean_nees = [&](const std::vector<std::string>& more) {
    config::Node changed = configuration;
    for (const auto& text : more) {
      const auto assignment = config::parse_assignment(text);
      config::set_path(changed, assignment.path, assignment.value);
    }
    double sum = 0.;
    for (int seed = 1; seed <= runs; ++seed) {
      sum += testing::run(changed, static_cast<std::uint64_t>(seed)).nees_planar;
    }
    return sum / runs;
  };
  const auto bounds = eval::mean_nees_bounds(3, runs, 0.999);
  const double nees = mean_nees({});
  EXPECT_GT(nees, bounds.low);
  EXPECT_LT(nees, bounds.high);
  // A filter that takes the intrinsics for twice as certain fails the same test.
  EXPECT_GT(mean_nees({"kinematics.prior_sigma_position_m=0.00005",
                       "kinematics.prior_sigma_radius_m=0.000005",
                       "kinematics.prior_sigma_steer_offset_rad=0.00015"}),
            bounds.high);
}

/// The rows are weighed by the calibration, wherever the zeros were thought to be.
TEST(Run, OfACalibrationIsThatOfTheSameNominalValues) {
  const std::string zeros = "steer_offset_rad=[0, 1.5, 1.5, -1.5]";
  const std::vector<std::string> robot{"odometry.twist=noise_weighted",
                                       "sensors.simulator0.robot." + zeros};
  const auto end_m = [&](const std::string& more) {
    auto all = robot;
    all.push_back(more);
    return testing::run(simulated("icr_sweep", all)).accuracy->end_m;
  };
  const auto folder = fresh_folder("far_zeros");
  std::filesystem::create_directories(folder);
  const auto file = folder / "calibration.yaml";
  const auto model = read_run(simulated("icr_sweep", robot), registry()).model;
  std::ofstream out(file);
  out << "model: four_wis_wid\ntwist: noise_weighted\nintrinsics:\n";
  out.precision(17);
  for (int i = 0; i < model->n_intrinsics(); ++i) {
    const std::string& name = model->description().intrinsics[static_cast<std::size_t>(i)].name;
    const bool is_zero = name.starts_with("delta_o") && name != "delta_o1";
    const double value = is_zero ? (name == "delta_o4" ? -1.5 : 1.5) : model->nominal()[i];
    out << "  " << name << ": {estimate: " << value << ", sigma: 1.0e-6}\n";
  }
  out.close();
  EXPECT_NEAR(end_m("kinematics.calibration=" + file.string()), end_m("kinematics." + zeros), 1e-9);
}

TEST(Run, GivesTheSameBitsForTheSameSeedAndOthersForAnother) {
  const auto configuration = simulated("figure_eight");
  const auto first = testing::run(configuration, 3), second = testing::run(configuration, 3),
             other = testing::run(configuration, 4);
  EXPECT_EQ(first.total.g, second.total.g);
  EXPECT_EQ(first.total.P_g, second.total.P_g);
  EXPECT_NE(first.total.g, other.total.g);
}

TEST(Run, CountsRankDeficientSamplesOfParallelRollingRows) {
  const auto result =
      testing::run(simulated("straight", {"kinematics.type=four_wis_wid_drive_only"}));
  EXPECT_EQ(result.status, RunStatus::kOk);
  EXPECT_GT(result.total.rank_deficient, result.total.samples * 9 / 10);
  EXPECT_LT(result.accuracy->end_m, 0.1);
}

TEST(Run, GatesInjectedSlip) {
  // On a circle the twist that bridges what is not believed is the true one.
  const std::vector<std::string> slip{"sensors.simulator0.slip_start_s=[5, 10]",
                                      "sensors.simulator0.slip_duration_s=1",
                                      "sensors.simulator0.slip_ratio=0.5"};
  auto with_gate = slip;
  with_gate.emplace_back("odometry.parity_gate_probability=1e-6");
  const auto open = testing::run(simulated("circle", slip));
  const auto gated = testing::run(simulated("circle", with_gate));
  EXPECT_EQ(open.total.gated, 0);
  EXPECT_GT(gated.total.gated, 180);
  EXPECT_LT(gated.total.gated, 230);
  EXPECT_LT(gated.accuracy->end_m, 0.5 * open.accuracy->end_m);
}

TEST(Simulate, WritesALogThatPlaysBackToTheSameBits) {
  const auto folder = fresh_folder("log");
  const auto direct = testing::run(simulated("icr_sweep"));
  RunSetup setup = read_run(simulated("icr_sweep"), registry());
  const SimulateResult written = write_log(setup, folder);
  EXPECT_EQ(written.counts.at("encoders"), 2001);
  EXPECT_TRUE(written.left_out.empty());
  auto replay = simulated("icr_sweep");
  replay.set("sensors",
             config::parse("wheels0: {type: asl_encoders, path: " + (folder / "wheels0").string() +
                               "}\ntruth: {type: asl_pose, path: " +
                               (folder / "state_groundtruth_estimate0").string() + "}",
                           "replay"));
  const auto played = testing::run(replay);
  EXPECT_EQ(played.total.g, direct.total.g);
  EXPECT_EQ(played.total.P_g, direct.total.P_g);
  EXPECT_EQ(played.accuracy->end_m, direct.accuracy->end_m);
}

TEST(Run, OfWheelsThatContradictThemselvesIsDoubtful) {
  const auto doubts = [](const std::string& fault) {
    std::vector<std::string> assignments;
    if (!fault.empty()) assignments.push_back("sensors.simulator0." + fault);
    const RunResult result = testing::run(simulated("icr_sweep", assignments));
    EXPECT_EQ(result.status, RunStatus::kOk);
    return result.doubts;
  };
  EXPECT_THAT(doubts(""), IsEmpty());
  EXPECT_THAT(doubts("drive_scale=[1, -1, 1, 1]"),
              Contains(HasSubstr("drive_2 turns opposite to what the other wheels say")));
  EXPECT_THAT(doubts("drive_scale=[1, 1, 2, 1]"),
              Contains(HasSubstr("drive_3 turns 2 times as fast as the other wheels say")));
  EXPECT_THAT(doubts("steer_scale=[57.3, 57.3, 57.3, 57.3]"),
              Contains(HasSubstr("the steering angles are in degrees")));
}

/// Of two wheels neither can contradict the other: the gyro of the log does.
TEST(Run, OfWheelsThatAGyroContradictsIsDoubtful) {
  const auto doubts = [](const std::string& assignment) {
    const RunResult result = testing::run(resolve_placeholders(
        load_run_configuration(testing::configuration("runs/viwo_skid_steer.yaml"),
                               {"estimator.type=dead_reckoning", "sensors.simulator0.duration_s=30",
                                "sensors.simulator0.features=0", assignment})));
    EXPECT_EQ(result.status, RunStatus::kOk);
    return result.doubts;
  };
  EXPECT_THAT(doubts("sensors.simulator0.drive_scale=[1, 1]"), IsEmpty());
  EXPECT_THAT(doubts("sensors.simulator0.drive_scale=[1, -1]"),
              Contains(HasSubstr("drive_2 turns opposite")));
  EXPECT_THAT(doubts("sensors.simulator0.drive_scale=[-1, -1]"),
              Contains(HasSubstr("turns opposite to")));
  EXPECT_THAT(doubts("sensors.simulator0.drive_scale=[7, 7]"),
              Contains(HasSubstr("unit or scale of the drives")));
}

/// Of a sensor of others: those of viwo look at what they read themselves.
TEST(Run, CountsWhatASensorMustNotGive) {
  RunSetup setup = read_run(simulated("circle"), registry(), 1);
  const RunData whole = collect(setup);
  std::vector<Measurement> all;
  for (const EncoderSample& wheels : whole.wheels()) {
    all.emplace_back(wheels);
    if (all.size() % 500 == 0) all.emplace_back(wheels);
  }
  for (const StampedPose& pose : whole.reference) {
    const Eigen::Vector3d& p = pose.p_BinW;
    const Eigen::Vector4d& q = pose.q_BtoW.coeffs();
    all.emplace_back(PoseSample{pose.t_ns, {p.x(), p.y(), p.z()}, {q[0], q[1], q[2], q[3]}});
  }
  all.emplace_back(PoseSample{whole.reference.back().t_ns + 1, {}, {0., 0., 0., 0.}});
  all.emplace_back(PoseSample{whole.reference.back().t_ns + 2, {0., 0., std::nan("")}});
  all.emplace_back(PoseSample{INT64_MAX, {}});
  all.emplace_back(PoseSample{whole.reference[7].t_ns, {5., 5., 0.}});
  const auto sensor =
      std::make_shared<testing::InMemory>(sample_types<EncoderSample, PoseSample>(), all);
  testing::set_sensors(setup, {{"robot", sensor}});
  const RunResult result = run_odometry(setup, collect(setup));
  ASSERT_EQ(result.status, RunStatus::kOk) << result.cause;
  EXPECT_EQ(result.accuracy->end_m, run_odometry(setup, whole).accuracy->end_m);
  std::vector<std::string> told;
  for (const auto& [name, rejection] : result.rejections) {
    told.push_back(name + " " + rejection.reason + " " + std::to_string(rejection.count));
  }
  EXPECT_THAT(told, ElementsAre("robot encoders: begins before the end of the last 4",
                                "robot poses: quaternion that is not of unit norm 1",
                                "robot poses: value that is not finite 1",
                                "robot poses: stamp that is none 1",
                                "robot poses: stamp not after the last 1"));
}

TEST(Output, HasTheNamesThatScriptsRelyOn) {
  const auto folder = fresh_folder("run");
  RunSetup setup =
      read_run(simulated("circle", {"evaluation.segment_lengths_m=[10, 25]"}), registry());
  const RunData data = collect(setup);
  write_run(folder, setup, run_odometry(setup, data));
  for (const char* file : {"config.resolved.yaml", "trajectory.tum", "reference.tum",
                           "calibration.csv", "timing.csv", "summary.json", "report.html"}) {
    EXPECT_TRUE(std::filesystem::exists(folder / file)) << file;
  }
  std::ifstream in(folder / "summary.json");
  const auto summary = nlohmann::json::parse(in);
  EXPECT_EQ(summary.at("status"), "ok");
  EXPECT_EQ(summary.at("seed"), 1);
  EXPECT_EQ(summary.at("epochs"), 200);
  for (const char* key : {"duration_s", "wall_s", "accuracy", "calibration", "updates", "timing_ms",
                          "realtime_factor", "peak_rss_mb"}) {
    EXPECT_TRUE(summary.contains(key)) << key;
  }
  EXPECT_TRUE(summary["calibration"]["r_1"].contains("sigma"));
  EXPECT_TRUE(summary["accuracy"]["rpe"].contains("10"));
  EXPECT_EQ(log::read_tum(folder / "trajectory.tum").size(), 201u);
}

}  // namespace
}  // namespace viwo
