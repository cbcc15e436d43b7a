// What is wrong with a configuration is said with its position, and nothing is written.
#include "support.hpp"

namespace viwo {
namespace {

class ConfigurationTest : public CommandLineTest {
 protected:
  /// The run with one thing changed.
  void refuse_run(const std::string& from, const std::string& to,
                  const std::string& message) const {
    ASSERT_NE(kRun.find(from), std::string::npos) << from;
    write("run.yaml", replaced(kRun, from, to));
    SCOPED_TRACE(to);
    expect_refused({"run", "run.yaml", "--out", "out"}, message);
  }

  void refuse_set(const std::string& assignment, const std::string& message) const {
    write("run.yaml", kRun);
    SCOPED_TRACE(assignment);
    expect_refused({"run", "run.yaml", "--out", "out", "--set", assignment}, message);
  }

  void refuse_experiment(const std::string& from, const std::string& to,
                         const std::string& message) const {
    ASSERT_NE(kExperiment.find(from), std::string::npos) << from;
    write("run.yaml", replaced(kRun, "motion: circle", "motion: \"{motion}\""));
    write("e.yaml", replaced(kExperiment, from, to));
    SCOPED_TRACE(to);
    expect_refused({"experiment", "e.yaml", "--out", "out"}, message);
  }

  inline static const std::string kSearched =
      std::string(" (searched ") + VIWO_TEST_PLUGIN_DIR + ")";
  inline static const std::string kExperiment =
      "experiment: e\n"                                         // 1
      "base: run.yaml\n"                                        // 2
      "seeds: 2\n"                                              // 3
      "motions: [circle, straight]\n"                           // 4
      "variants:\n"                                             // 5
      "  redundant:\n"                                          // 6
      "  drive: {kinematics.type: four_wis_wid_drive_only}\n";  // 7
};

TEST_F(ConfigurationTest, MustBeAFileOfYaml) {
  const auto run = [&](const std::string& file, const std::string& message) {
    expect_refused({"run", file, "--out", "out"}, message);
  };
  run("none.yaml", "none.yaml  no such file");
  run(".", ".  is a folder, not a file");
  write("open.yaml", "a: [1\n");
  run("open.yaml", "open.yaml:2:1  not valid YAML: end of sequence flow not found");
  write("tab.yaml", "sensors:\n\tsim: 1\n");
  run("tab.yaml",
      "tab.yaml:2:5  not valid YAML: illegal map value (YAML is indented by spaces, this line by a "
      "tab)");
  write("list.yaml", "- 1\n");
  run("list.yaml", "list.yaml:1:1  a run configuration is a section of keys");
  write("empty.yaml", "");
  run("empty.yaml", "empty.yaml:1:1  a run configuration is a section of keys");
  write("experiment.yaml", "experiment: e\nbase: run.yaml\nvariants: {a: }\n");
  run("experiment.yaml",
      "experiment.yaml:1:1  this is an experiment, not a run: viwo experiment takes it");
  write("calibration.yaml", "base: run.yaml\ncalibration: c\n");
  run("calibration.yaml",
      "calibration.yaml:2:1  this is a calibration, not a run: viwo calibrate takes it");
  write("run.yaml", kRun);
  for (const auto& [command, kind] : {std::pair{"calibrate", "a calibration"},
                                      {"plan", "a plan"},
                                      {"experiment", "an experiment"}}) {
    expect_refused({command, "run.yaml", "--out", "out"},
                   std::string("run.yaml:2:1  this is a run, not ") + kind + ": viwo run takes it");
  }
  write("plan.yaml", "plan: p\ngoals: {r_left: 1 %}\n");
  run("plan.yaml", "plan.yaml:1:1  this is a plan, not a run: viwo plan takes it");
  write("binary.yaml", std::string("\x7f\0\1", 3));
  run("binary.yaml", "binary.yaml  is not a text file");
}

TEST_F(ConfigurationTest, RefusesUnknownKeys) {
  refuse_run("name: small", "nmae: small",
             "run.yaml:1:1  run: unknown key 'nmae' - did you mean 'name'?");
  refuse_run("name: small", "placeholder: {a: 1}",
             "run.yaml:1:1  run: unknown key 'placeholder' - did you mean 'placeholders'?");
  refuse_run("    duration_s", "    duration",
             "run.yaml:11:5  sensors.sim (planar_simulator): unknown key 'duration' - duration is "
             "in s, did you mean 'duration_s'?");
  refuse_run("*robot", "*robot\nsensors: 3",
             "run.yaml:14:1  key 'sensors' appears twice (first at run.yaml:2:1)");
}

TEST_F(ConfigurationTest, RefusesAWrongUnitForTheRobotAndItsSimulation) {
  // Model and simulated robot are one section of the file: both complain.
  refuse_run(
      "radius_m: 0.025", "radius_mm: 25",
      "run.yaml:5:12  kinematics (four_wis_wid): 'radius_m' is missing (wheel radii, one for "
      "all or one per wheel, m)\n"
      "run.yaml:5:12  sensors.sim.robot (four_wis_wid): 'radius_m' is missing (wheel radii, "
      "one for all or one per wheel, m)\n"
      "run.yaml:9:7  kinematics (four_wis_wid): unknown key 'radius_mm' - radius is in m, did "
      "you mean 'radius_m'?\n"
      "run.yaml:9:7  sensors.sim.robot (four_wis_wid): unknown key 'radius_mm' - radius is in "
      "m, did you mean 'radius_m'?");
}

TEST_F(ConfigurationTest, RefusesWrongValues) {
  refuse_run("duration_s: 5", "duration_s: long",
             "run.yaml:11:17  sensors.sim.duration_s: 'long' is not a number");
  refuse_run("duration_s: 5", "duration_s: 5 s",
             "run.yaml:11:17  sensors.sim.duration_s: '5 s' is not a number - write the number "
             "alone, it is in s");
  refuse_run("duration_s: 5", "duration_s: [5]",
             "run.yaml:11:17  sensors.sim.duration_s: expected a number, got a list (how long, s)");
  refuse_run("duration_s: 5", "duration_s: 0",
             "run.yaml:11:17  sensors.sim.duration_s: 0 violates 0 < duration_s <= 7200 (how long, "
             "s)");
  refuse_run("motion: circle", "motion: cirlce",
             "run.yaml:12:13  sensors.sim.motion: unknown value 'cirlce' - did you mean 'circle'?");
  refuse_run("*robot", "*robot\nodometry: {twist: planar, epochs: 3}",
             "run.yaml:14:19  odometry.twist: unknown value 'planar' - known: auto, plain, "
             "noise_weighted\n"
             "run.yaml:14:27  odometry: unknown key 'epochs' - did you mean 'epoch_s'?");
}

TEST_F(ConfigurationTest, RefusesMissingPlugins) {
  refuse_run("type: planar_simulator", "type: palnar_simulator",
             "run.yaml:4:11  sensors.sim.type: no sensor plugin 'palnar_simulator' - did you mean "
             "'planar_simulator'?" +
                 kSearched);
  refuse_run("kinematics: *robot", "kinematics: {type: planar_simulator}",
             "run.yaml:13:20  kinematics.type: no kinematics plugin 'planar_simulator' - known: "
             "ackermann, body_twist, differential, four_wis_wid, four_wis_wid_drive_only, mecanum, "
             "skid_steer" +
                 kSearched);
  refuse_run(
      "kinematics: *robot\n", "",
      "run.yaml:1:1  'kinematics' is missing: the section of the kinematic model (a filter, with "
      "'updates', does without)");
}

TEST_F(ConfigurationTest, RefusesSensorsThatDoNotFitTheModel) {
  // Whether a position stands before it is not fixed here.
  const std::string three =
      "kinematics: {type: four_wis_wid, x_m: [0.1, -0.1, 0], y_m: [0.1, 0.1, 0], radius_m: 0.02}";
  const auto ends_with = [&](const std::string& from, const std::string& to,
                             const std::string& message) {
    write("run.yaml", replaced(kRun, from, to));
    const Outcome outcome = viwo({"run", "run.yaml", "--out", "out"});
    EXPECT_EQ(outcome.code, 2);
    EXPECT_TRUE(outcome.err.ends_with(message + "\n")) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(at("out")));
  };
  ends_with("kinematics: *robot", three,
            "sensors.sim has 4 drive and 4 steering channels, but the kinematic model has 3 driven "
            "and 3 steered wheels");
  ends_with("kinematics: *robot",
            "kinematics: {type: differential, radius_left_m: 0.02, radius_right_m: 0.02, "
            "baseline_m: 0.2}",
            "sensors.sim has 4 drive and 4 steering channels, but the kinematic model has 2 driven "
            "and 0 steered wheels");
  ends_with("kinematics: *robot",
            "  sim2: {type: planar_simulator, robot: *robot, duration_s: 5}\n"
            "kinematics: *robot",
            "run.yaml:3:3  both 'sim' and 'sim2' give encoders: a run takes them from one sensor - "
            "name it: wheels.sensor: NAME\n"
            "run.yaml:3:3  both 'sim' and 'sim2' give poses: a run takes them from one sensor as "
            "reference");
}

TEST_F(ConfigurationTest, RefusesNonsenseInSet) {
  refuse_set("nonsense", "--set nonsense  expected path.to.key=value");
  refuse_set("=3", "--set =3  expected path.to.key=value");
  refuse_set("odometry.epohc_s=3",
             "--set odometry.epohc_s  odometry: unknown key 'epohc_s' - did you mean 'epoch_s'?");
  refuse_set("sensors.sim.duration_s=x",
             "--set sensors.sim.duration_s  sensors.sim.duration_s: 'x' is not a number");
  refuse_set("name.x=1", "--set name.x  'name' is a single value: cannot set 'name.x'");
  refuse_set("sensors..x=1",
             "--set sensors..x  'sensors..x' is not a path (as in kinematics.type)");
  refuse_set("odometry.epoch_s=[1",
             "--set odometry.epoch_s  not valid YAML: end of sequence flow not found");
  refuse_set("kinematics.x_m.9=1",
             "--set kinematics.x_m.9  'kinematics.x_m' is a list of 4 (counted from 0), it has no "
             "element '9'");
}

TEST_F(ConfigurationTest, RefusesUnknownPlaceholders) {
  refuse_run(
      "motion: circle\n", "motion: \"{motoin}\"\nplaceholders: {motion: circle}\n",
      "run.yaml:12:13  unknown placeholder '{motoin}' in '{motoin}' - did you mean 'motion'?");
}

TEST_F(ConfigurationTest, RefusesPlaceholdersThatAreUsedNowhere) {
  refuse_run("motion: circle\n",
             "motion: \"{motion}\"\nplaceholders: {motion: circle, motoin: a}\n",
             "run.yaml:13:32  placeholder 'motoin' is used nowhere - did you mean 'motion'?");
  write("run.yaml", replaced(kRun, "motion: circle\n",
                             "motion: \"{motion}\"\nplaceholders: {motion: circle}\n"));
  expect_refused({"run", "run.yaml", "--set", "placeholders.motoin=a"},
                 "--set placeholders.motoin  placeholder 'motoin' is used nowhere - did you mean "
                 "'motion'?");
  expect_done({"run", "run.yaml", "--set", "sensors.sim.motion=straight", "--out", "out"});
}

TEST_F(ConfigurationTest, RefusesPlaceholdersThatEachRecordingOverrules) {
  write("run.yaml", replaced(kRun, "motion: circle\n",
                             "motion: \"{motion}\"\nplaceholders: {motion: circle}\n"));
  write("e.yaml", kExperiment);
  expect_refused({"experiment", "e.yaml", "--set", "placeholders.motion=spin"},
                 "--set placeholders.motion  each recording of e.yaml has its own 'motion': change "
                 "the list there");
  write("e.yaml", replaced(kExperiment, "motions: [circle, straight]\n", ""));
  expect_done({"experiment", "e.yaml", "--set", "placeholders.motion=spin", "--out", "out"});
}

TEST_F(ConfigurationTest, RefusesPlaceholdersThatNoVariantUses) {
  const auto refuse = [&](const std::string& from, const std::string& to, const char* mark) {
    refuse_experiment(
        from, to,
        std::string(mark) + "  placeholder 'motoin' is used nowhere - did you mean 'motion'?");
  };
  refuse("redundant:", "redundant: {placeholders.motoin: 3}", "e.yaml:6:15");
  refuse("circle, straight", "{motion: circle, name: a, motoin: b}", "e.yaml:4:37");
  refuse("seeds: 2", "set: {placeholders: {motoin: 2}}", "e.yaml:3:22");
  // Used by one variant only, written over in another, and a label to know what is what.
  write("run.yaml", replaced(kRun, "motion: circle\n", "motion: \"{motion}\"\n"));
  write("e.yaml",
        replaced(replaced(kExperiment, "circle, straight", "{motion: circle, made_on: monday}"),
                 "redundant:",
                 "redundant: {sensors.sim.motion: \"{a}\", "
                 "placeholders.a: straight}"));
  expect_done({"experiment", "e.yaml", "--out", "out"});
}

TEST_F(ConfigurationTest, RefusesACalibrationThatDoesNotFit) {
  write("run.yaml", kRun);
  write("c.yaml", "calibration: c\nbase: run.yaml\nsegment_s: 0.5\n");
  expect_done({"calibrate", "c.yaml", "--out", "cal"});
  const std::string model =
      ", x_m: [0.1, -0.1, -0.1, 0.1], y_m: [0.1, 0.1, -0.1, -0.1], "
      "radius_m: 0.025, calibration: cal/calibration.yaml}";
  write("run.yaml",
        replaced(kRun, "kinematics: *robot", "kinematics: {type: four_wis_wid" + model));
  expect_done({"run", "run.yaml", "--out", "fits"});
  write("turned.yaml", read("cal/calibration.yaml") + "drive_signs: [1, 1, -1, 1]\n");
  refuse_run(
      "kinematics: *robot",
      "kinematics: {type: four_wis_wid" + replaced(model, "cal/calibration.yaml", "turned.yaml"),
      "TMP/turned.yaml  this calibration is for drives that turn otherwise than configured: "
      "write sensors.sim.drive_scale: [1, 1, -1, 1], with the sizes that are there");
  refuse_run("kinematics: *robot", "kinematics: {type: four_wis_wid_drive_only" + model,
             "TMP/cal/calibration.yaml:2:8  this calibration is for the model 'four_wis_wid', the "
             "run has 'four_wis_wid_drive_only'");
  write("cal/calibration.yaml", replaced(read("cal/calibration.yaml"), "  r_2:", "  r_5:"));
  refuse_run(
      "kinematics: *robot", "kinematics: {type: four_wis_wid" + model,
      "TMP/cal/calibration.yaml:6:3  intrinsic 'r_2' is missing\n"
      "TMP/cal/calibration.yaml:11:3  the model 'four_wis_wid' has no intrinsic 'r_5' - known: "
      "r_1, r_2, r_3, r_4, x_1, x_2, x_3, x_4, y_1, y_2, y_3, y_4, delta_o1, delta_o2, "
      "delta_o3, delta_o4");
}

TEST_F(ConfigurationTest, RefusesLabelsAndSegmentsOfACalibrationThatAreMeantOtherwise) {
  write("run.yaml", kRun);
  const auto refuse = [&](const std::string& more, const std::string& message) {
    write("c.yaml", "calibration: c\nbase: run.yaml\n" + more);
    expect_refused({"calibrate", "c.yaml", "--out", "out"}, message);
  };
  refuse("recordings: [{recording: a, distance: 4}]\n",
         "c.yaml:3:14  recording 'a': label 'distance' - did you mean 'distance_m'?");
  refuse("segment_s: 1e-6\n",
         "c.yaml:3:12  segment_s is shorter than the interval between readings of the wheels, "
         "0.01 s");
  refuse("segment_s: 0.05\nset: {sensors.sim.reference_rate_hz: 5}\n",
         "c.yaml:3:12  segment_s is shorter than the interval between poses, 0.2 s");
  // Keys of the calibration itself can be set as those of its base can.
  write("c.yaml", "calibration: c\nbase: run.yaml\n");
  const Outcome none = viwo({"calibrate", "c.yaml", "--set", "reference=gyro", "--out", "out"});
  EXPECT_EQ(none.code, 2);
  EXPECT_NE(none.err.find("c.yaml:1:1  the recording has no gyro to calibrate against"),
            std::string::npos)
      << none.err;
}

TEST_F(ConfigurationTest, RefusesAMissingCalibrationFile) {
  write("run.yaml", replaced(kRun, "kinematics: *robot",
                             "kinematics: {type: four_wis_wid, x_m: [0.1, -0.1], y_m: [0, 0], "
                             "radius_m: 0.02, calibration: none.yaml}"));
  const Outcome outcome = viwo({"run", "run.yaml", "--out", "out"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.err.find("kinematics.calibration: no such file: "), std::string::npos)
      << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(at("out")));
}

TEST_F(ConfigurationTest, RefusesExperimentsThatAreNone) {
  const std::string no_variants =
      "'variants' must be a section with at least one variant: NAME: {overrides}";
  const std::string variants = kExperiment.substr(kExperiment.find("variants"));
  refuse_experiment(variants, "", "e.yaml:1:1  " + no_variants);
  refuse_experiment(variants, "variants: {}\n", "e.yaml:5:11  " + no_variants);
  refuse_experiment("redundant:", "redundant: 3",
                    "e.yaml:6:14  variant 'redundant' must be a section of overrides");
  refuse_experiment("base: run.yaml", "base: none.yaml",
                    "e.yaml:2:7  base: no such file: none.yaml");
  refuse_experiment(
      "base: run.yaml\n", "",
      "e.yaml:1:1  experiment: 'base' is missing (run configuration, relative to this "
      "file)");
  refuse_experiment("seeds: 2", "sedes: 2",
                    "e.yaml:3:1  experiment: unknown key 'sedes' - did you mean 'seeds'?");
  refuse_experiment("seeds: 2", "seeds: 0",
                    "e.yaml:3:8  experiment.seeds: 0 violates seeds >= 1 (runs of each variant and "
                    "recording, with seeds 1, 2, ...)");
}

TEST_F(ConfigurationTest, RefusesVariantsAndRecordingsThatDoNotFit) {
  refuse_experiment("redundant:", "redundant: {kinematics.typ: x}",
                    "e.yaml:6:15  kinematics (four_wis_wid): unknown key 'typ' - did you mean "
                    "'type'?\ne.yaml:4:11  while reading recording 'circle'");
  refuse_experiment(
      "redundant:", "drive:", "e.yaml:7:3  key 'drive' appears twice (first at e.yaml:6:3)");
  refuse_experiment("straight", "circle", "e.yaml:4:19  'circle' is in this list twice");
  refuse_experiment("motions: [circle, straight]", "recordings: [1, 2, 1]",
                    "e.yaml:4:20  '1' is in this list twice");
  refuse_experiment("[circle, straight]", "[]",
                    "e.yaml:4:10  this must be a list with at least one element");
  refuse_experiment("straight", "strait",
                    "run.yaml:12:13  sensors.sim.motion: unknown value 'strait' - did you mean "
                    "'straight'?\ne.yaml:4:19  while reading recording 'strait'");
  refuse_experiment("motions:", "recordings:",
                    "run.yaml:12:13  unknown placeholder '{motion}' in '{motion}' - known: "
                    "recording");
}

}  // namespace
}  // namespace viwo
