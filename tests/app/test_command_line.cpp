// Commands, options, help.
#include "support.hpp"

namespace viwo {
namespace {

constexpr const char* kRunUsage =
    "usage: viwo run CONFIG [--out DIR] [--seed N] [--set KEY=VALUE]...";

TEST_F(CommandLineTest, WithoutArgumentsPrintsTheHelpAndFails) {
  const Outcome nothing = viwo({});
  const Outcome help = viwo({"--help"});
  EXPECT_EQ(nothing.code, 2);
  EXPECT_EQ(help.code, 0);
  EXPECT_EQ(nothing.out, help.out);
  EXPECT_EQ(help.err, "");
  for (const char* command :
       {"run CONFIG", "experiment EXPERIMENT", "calibrate CONFIG", "plan CONFIG",
        "simulate CONFIG --out DIR", "evaluate --reference A.tum --estimate B.tum",
        "plugins list | describe NAME | schema | check FILE | new KIND NAME [--out DIR]"}) {
    EXPECT_NE(help.out.find("\n  viwo " + std::string(command)), std::string::npos) << command;
  }
}

TEST_F(CommandLineTest, PrintsItsVersion) {
  const Outcome version = expect_done({"--version"});
  EXPECT_EQ(version.out, "viwo " VIWO_TEST_VERSION "\n");
}

TEST_F(CommandLineTest, LoadsNothingForImagesWindowsAndVideosUnlessTheyAreWanted) {
  setenv("LD_TRACE_LOADED_OBJECTS", "1", 1);  // the loader names what it would load
  const Outcome loaded = viwo({"--version"});
  unsetenv("LD_TRACE_LOADED_OBJECTS");
  EXPECT_NE(loaded.out.find("libviwo_api.so"), std::string::npos) << loaded.out;
  for (const char* part : {"imgcodecs", "videoio", "highgui", "libQt", "libgtk"}) {
    EXPECT_EQ(loaded.out.find(part), std::string::npos) << loaded.out;
  }
}

TEST_F(CommandLineTest, EveryCommandExplainsItself) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> commands = {
      {"run", {"--out", "--seed", "--set"}},
      {"experiment", {"--out", "--jobs", "--seeds", "--set", "--keep-runs"}},
      {"inspect", {"--out", "--set", "--fix"}},
      {"calibrate", {"--out", "--set"}},
      {"plan", {"--out", "--set"}},
      {"simulate", {"--out", "--seed", "--set"}},
      {"evaluate", {"--reference", "--estimate", "--align", "--out"}},
      {"plugins", {"--out"}}};
  for (const auto& [command, options] : commands) {
    const Outcome help = expect_done({command, "--help"});
    EXPECT_EQ(help.out.find("Usage: viwo " + command + " "), 0U) << help.out;
    EXPECT_EQ(help.err, "");
    for (const std::string& option : options) {
      EXPECT_NE(help.out.find(option + " "), std::string::npos) << command << " " << option;
    }
    EXPECT_NE(help.out.find("--plugin-path DIR"), std::string::npos) << command;
  }
}

TEST_F(CommandLineTest, SuggestsTheNearestCommand) {
  expect_refused({"rnu", "x.yaml"}, "viwo: unknown command 'rnu' - did you mean 'run'?");
  expect_refused({"help"}, "viwo: unknown command 'help' - did you mean '--help'?");
  expect_refused({"--hlep"}, "viwo: unknown command '--hlep' - did you mean '--help'?");
  const Outcome far = viwo({"frobnicate"});
  EXPECT_EQ(far.code, 2);
  EXPECT_EQ(far.err.find("viwo: unknown command 'frobnicate' - known: "), 0U) << far.err;
}

TEST_F(CommandLineTest, SuggestsTheNearestOption) {
  write("run.yaml", kRun);
  expect_refused({"run", "run.yaml", "--sed", "3"},
                 "viwo run: unrecognised option '--sed' - did you mean '--seed'? (see viwo run "
                 "--help)");
  expect_refused({"run", "run.yaml", "--seeds", "3"},
                 "viwo run: unrecognised option '--seeds' - did you mean '--seed'? (see viwo run "
                 "--help)");
  expect_refused({"run", "run.yaml", "--frobnicate"},
                 "viwo run: unrecognised option '--frobnicate' - known: --out, --seed, --set, "
                 "--figures, --show, --video, --mcap, --plan, --lockstep, --plugin-path, "
                 "--help (see viwo run --help)");
}

TEST_F(CommandLineTest, RefusesMissingAndSuperfluousArguments) {
  write("run.yaml", kRun);
  const std::string see = " (see viwo run --help)";
  expect_refused({"run"}, std::string("viwo run: CONFIG is missing - ") + kRunUsage + see);
  expect_refused({"run", "run.yaml", "twice.yaml"},
                 std::string("viwo run: what is 'twice.yaml'? - ") + kRunUsage + see);
  expect_refused({"run", "run.yaml", "--seed"},
                 "viwo run: the required argument for option '--seed' is missing" + see);
  expect_refused({"simulate", "run.yaml"},
                 "viwo simulate: the option '--out' is required but missing (see viwo simulate "
                 "--help)");
  expect_refused({"evaluate", "--reference", "a.tum"},
                 "viwo evaluate: the option '--estimate' is required but missing (see viwo "
                 "evaluate --help)");
  expect_refused(
      {"plugins"},
      "viwo plugins: what to do is missing - usage: viwo plugins list | describe NAME | schema | "
      "check FILE | new KIND NAME [--out DIR] (see viwo plugins --help)");
}

TEST_F(CommandLineTest, RefusesOptionValuesThatMakeNoSense) {
  write("run.yaml", kRun);
  const auto run = [&](const std::string& option, const std::string& value,
                       const std::string& text) {
    expect_refused({"run", "run.yaml", option, value},
                   "viwo run: " + text + " (see viwo run --help)");
  };
  run("--seed", "abc", "the argument ('abc') for option '--seed' is invalid");
  run("--seed", "1.5", "the argument ('1.5') for option '--seed' is invalid");
  run("--seed", "-1", "--seed must not be negative");
  run("--out", "", "--out needs the name of a folder");
  const auto experiment = [&](const std::string& option, const std::string& value,
                              const std::string& text) {
    expect_refused({"experiment", "e.yaml", option, value},
                   "viwo experiment: " + text + " (see viwo experiment --help)");
  };
  experiment("--seeds", "0", "--seeds must be at least 1");
  experiment("--seeds", "-3", "--seeds must be at least 1");
  experiment("--jobs", "-1", "--jobs must not be negative");
  experiment("--jobs", "two", "the argument ('two') for option '--jobs' is invalid");
  // A variable of the shell that is not set is not the whole experiment.
  const Outcome shard = viwo({"experiment", "e.yaml", "--out", "here", "--shard", ""});
  EXPECT_NE(shard.code, 0);
  EXPECT_NE(shard.err.find("--shard : there is no '/'"), std::string::npos) << shard.err;
}

TEST_F(CommandLineTest, ListsAndDescribesPlugins) {
  const Outcome list = expect_done({"plugins", "list"});
  for (const char* name : {"kinematics  four_wis_wid  1", "kinematics  differential  1",
                           "sensor  planar_simulator  1", "sensor  asl_encoders  1"}) {
    EXPECT_NE(list.out.find(name), std::string::npos) << name << "\n" << list.out;
  }
  EXPECT_EQ(list.out.find("refused"), std::string::npos) << list.out;
  const Outcome describe = expect_done({"plugins", "describe", "differential"});
  EXPECT_NE(describe.out.find("\ntype: differential\n"), std::string::npos) << describe.out;
  EXPECT_NE(describe.out.find("\nbaseline_m: "), std::string::npos) << describe.out;
  expect_refused({"plugins", "describe", "diferential"},
                 "no plugin or section 'diferential' - did you mean 'differential'?");
  expect_refused({"plugins", "lst"}, "viwo plugins: unknown 'lst' - did you mean 'list'?");
  expect_refused(
      {"plugins", "describe"},
      "viwo plugins: usage: viwo plugins list | describe NAME | schema | check FILE | new KIND "
      "NAME [--out DIR]");
}

TEST_F(CommandLineTest, ChecksAPluginFile) {
  const std::string good = VIWO_TEST_PLUGIN_DIR "/libviwo_sensor_asl_pose.so";
  const Outcome checked = expect_done({"plugins", "check", good});
  EXPECT_EQ(checked.out.find("sensor  asl_pose  "), 0U) << checked.out;
  write("text.so", "no library\n");
  expect_refused({"plugins", "check", "text.so"},
                 "refusing text.so: is not a shared library - a plugin is built with "
                 "viwo_add_plugin()");
  expect_refused({"plugins", "check", "none.so"}, "refusing none.so: no such file");
  expect_refused({"plugins", "check", "."}, "refusing .: is a folder, not a shared library");
  expect_refused({"plugins", "list", "--plugin-path", "nowhere"},
                 "--plugin-path nowhere: no such folder");
}

TEST_F(CommandLineTest, ARefusedPluginIsListedAndTheOthersStillWork) {
  write("plugins/libviwo_kinematics_text.so", "no library\n");
  write("run.yaml", kRun);
  const Outcome list = expect_done({"plugins", "list", "--plugin-path", "plugins"});
  EXPECT_NE(list.out.find("\nrefused:\nplugins/libviwo_kinematics_text.so\n    is not a shared "
                          "library - a plugin is built with viwo_add_plugin()\n"),
            std::string::npos)
      << list.out;
  expect_done({"run", "run.yaml", "--out", "out", "--plugin-path", "plugins"});
}

TEST_F(CommandLineTest, APluginThatCannotBeLoadedIsMissingAndThatIsSaid) {
  const std::string name = "libviwo_kinematics_undefined.so";
  std::filesystem::create_directory(at("plugins"));
  EXPECT_EQ(viwo({"plugins", "schema", "--plugin-path", "plugins"}).err, "");
  write("plugins/libviwo_kinematics_text.so", "no library\n");
  const std::string text = "refusing plugins/libviwo_kinematics_text.so: is not a shared library";
  const Outcome refused = expect_done({"plugins", "schema", "--plugin-path", "plugins"});
  EXPECT_EQ(refused.err.find(text), 0U) << refused.err;
  std::filesystem::copy_file(VIWO_TEST_BINARY_DIR "/tests/plugins_bad/" + name,
                             at("plugins/" + name));
  const std::string unloaded = "refusing plugins/" + name + ": cannot be loaded: ";
  for (const char* const verb : {"list", "schema"}) {
    const Outcome outcome = viwo({"plugins", verb, "--plugin-path", "plugins"});
    EXPECT_EQ(outcome.code, 1) << verb;
    EXPECT_NE(outcome.err.find(unloaded), std::string::npos) << verb << "\n" << outcome.err;
    EXPECT_NE(outcome.out.find("four_wis_wid"), std::string::npos) << verb;
  }
  const Outcome describe = viwo({"plugins", "describe", "undefined", "--plugin-path", "plugins"});
  EXPECT_EQ(describe.code, 2);
  EXPECT_NE(describe.err.find("\n" + unloaded), std::string::npos) << describe.err;
}

TEST_F(CommandLineTest, EvaluateRefusesWhatItCannotCompare) {
  write("a.tum", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n");
  write("late.tum", "# a comment\n1000 0 0 0 0 0 0 1\n1001 1 0 0 0 0 0 1\n");
  write("seven.tum", "0 0 0 0 0 0 0\n");
  write("backward.tum", "1 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n");
  const auto evaluate = [&](const std::string& estimate, const std::string& message) {
    expect_refused({"evaluate", "--reference", "a.tum", "--estimate", estimate, "--out", "out"},
                   message);
  };
  evaluate("late.tum",
           "no pose of the estimate lies in the time of the reference: reference from 0.000 s to "
           "1.000 s, estimate from 1000.000 s to 1001.000 s");
  evaluate("seven.tum", "seven.tum:1  expected 8 numbers 't x y z qx qy qz qw', found 7 fields");
  evaluate("backward.tum", "backward.tum:2  the stamp is not after the previous one");
  evaluate("none.tum", "none.tum  cannot be read: No such file or directory");
  expect_refused({"evaluate", "--reference", "a.tum", "--estimate", "a.tum", "--align", "yaw"},
                 "--align yaw: known are none, start, yaw_position, se3");
}

TEST_F(CommandLineTest, EvaluateMeasuresAShiftThatTheAlignmentTakesOut) {
  // The estimate is 0.25 m to the left of the reference all along.
  write("a.tum", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 2 1 0 0 0 0 1\n");
  write("b.tum", "0 0 0.25 0 0 0 0 1\n1 1 0.25 0 0 0 0 1\n2 2 1.25 0 0 0 0 1\n");
  const auto ate_m = [&](const std::string& mode) {
    const Outcome outcome =
        expect_done({"evaluate", "--reference", "a.tum", "--estimate", "b.tum", "--align", mode});
    return nlohmann::json::parse(outcome.out).at("ate_m").get<double>();
  };
  EXPECT_NEAR(ate_m("none"), 0.25, 1e-12);
  EXPECT_NEAR(ate_m("yaw_position"), 0., 1e-12);
  EXPECT_NEAR(ate_m("start"), 0., 1e-12);
}

}  // namespace
}  // namespace viwo
