// Plugins that throw while a run goes on: what the run does, and what it says about it.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "message_of.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/report/html.hpp"
#include "viwo/results/run_output.hpp"
#include "viwo/run/run.hpp"
#include "viwo/setup/configuration.hpp"

namespace viwo {
namespace {

const std::string kBad = VIWO_TEST_BINARY_DIR "/tests/plugins_bad";
const std::string kSwerve =
    "x_m: [0.1, -0.1, -0.1, 0.1], y_m: [0.1, 0.1, -0.1, -0.1], radius_m: 0.025";

PluginRegistry& registry() {
  static PluginRegistry plugins({VIWO_TEST_PLUGIN_DIR, kBad});
  return plugins;
}

struct Outcome {
  RunSetup setup;
  RunResult result;
};

/// A simulated swerve robot for four seconds, 10 epochs per second.
Outcome run_of(const std::string& rest, const std::string& sensors = "") {
  const std::string yaml =
      "sensors:\n  s: {type: simulator, motion: straight, duration_s: 4, features: 10, "
      "cameras: " VIWO_TEST_SOURCE_DIR
      "/configs/cameras/pinhole.yaml, robot: {type: four_wis_wid, " +
      kSwerve + "}}\n" + sensors + rest;
  Outcome out;
  out.setup = read_run(config::parse(yaml, "run.yaml"), registry(), 1);
  const RunData data = collect(out.setup);
  out.result = run(out.setup, data);
  return out;
}

TEST(FailingUpdate, IsDisabledAfterTheConfiguredCountAndTheRunGoesOn) {
  const Outcome run = run_of("estimator: {max_update_failures: 3}\nupdates: {failing: {}}\n");
  EXPECT_EQ(run.result.status, RunStatus::kOk) << run.result.cause;
  EXPECT_GT(run.result.epochs, 35);
  const auto summary = summary_of(run.setup, run.result);
  EXPECT_EQ(summary["status"], "doubtful");
  EXPECT_EQ(summary["updates"]["failing"].dump(),
            R"({"applied":3,"cause":"lost in call 2","disabled":true,"failed":3,"rejected":0})");
  const std::string line = "update 'failing' failed in 3 epochs and was disabled: lost in call 2";
  EXPECT_NE(describe(run.result).find("\nwarning: " + line + "\n"), std::string::npos)
      << describe(run.result);
  EXPECT_NE(report::to_html(report_of(run.setup, run.result)).find("failed in 3 epochs"),
            std::string::npos);
}

TEST(FailingUpdate, IsSkippedInTheEpochsInWhichItThrows) {
  const Outcome run =
      run_of("estimator: {max_update_failures: 1000}\nupdates: {failing: {what: int}}\n");
  EXPECT_EQ(run.result.status, RunStatus::kOk) << run.result.cause;
  const auto summary = summary_of(run.setup, run.result)["updates"]["failing"];
  EXPECT_EQ(summary["failed"], run.result.epochs / 2);
  EXPECT_EQ(summary["disabled"], false);
  EXPECT_EQ(summary["cause"], "threw something that is not a std::exception");
  EXPECT_NE(describe(run.result).find("epochs, which it skipped: threw something"),
            std::string::npos);
}

TEST(FailingUpdate, IsDisabledAfterTenFailuresUnlessSaidOtherwise) {
  const Outcome run = run_of("updates: {failing: {}}\n");
  EXPECT_EQ(run.result.updates.at(0).failures.count, 10);
  EXPECT_TRUE(run.result.updates.at(0).failures.disabled);
  EXPECT_NE(config::to_yaml(run.setup.resolved).find("max_update_failures: 10\n"),
            std::string::npos);
}

TEST(FailingUpdate, ThatWorksSaysNothing) {
  const Outcome run =
      run_of("kinematics: {type: four_wis_wid, " + kSwerve + "}\nupdates: {wheel_odometry: {}}\n");
  const auto summary = summary_of(run.setup, run.result)["updates"]["wheel_odometry"];
  EXPECT_EQ(summary["failed"], 0);
  EXPECT_EQ(summary["disabled"], false);
  EXPECT_FALSE(summary.contains("cause"));
  EXPECT_EQ(describe(run.result).find("warning"), std::string::npos);
}

TEST(FailingUpdate, ThatBreaksItsContractIsDisabledAtOnce) {
  const Outcome run = run_of("updates: {failing: {what: contract}}\n");
  EXPECT_EQ(run.result.status, RunStatus::kOk) << run.result.cause;
  EXPECT_EQ(summary_of(run.setup, run.result)["updates"]["failing"].dump(),
            R"({"applied":1,"cause":"takes what it may not","disabled":true,"failed":1,)"
            R"("rejected":0})");
}

/// What the run with such an update throws.
std::string error_of(const std::string& updates, const std::string& sensors = "") {
  return testing::error_of<std::exception>(
      [&] { run_of("updates: {" + updates + "}\n", sensors); });
}

TEST(FailingUpdate, ThatCannotStartOrDeclareIsNamed) {
  const std::string plugin = "update plugin 'failing' 0.1.0 (" + kBad +
                             "/libviwo_update_failing.so) failed in declare or start: ";
  EXPECT_EQ(error_of("failing: {what: start}"), plugin + "cannot start");
  EXPECT_EQ(error_of("failing: {what: declare}"), plugin + "cannot say");
}

TEST(FailingUpdate, ThatLacksSomethingIsAnErrorOfItsSection) {
  EXPECT_EQ(error_of("failing: {what: input}"),
            "run.yaml:3:11  updates.failing: needs a barometer");
}

TEST(SamplesOfAnotherVersion, AreAnErrorOfTheConfigurationThatNamesBothPlugins) {
  const std::string sensor = "  r: {type: range}\n";
  EXPECT_EQ(error_of("failing: {}, range: {sensor: r}", sensor), "");
  EXPECT_EQ(error_of("failing: {}, range: {sensor: r}, range_2: {sensor: r}", sensor),
            "run.yaml:4:44  updates.range_2: update plugin 'range_2' 0.1.0 (" + kBad +
                "/libviwo_update_range_2.so) has samples 'range' of version 2, 24 bytes, update "
                "plugin 'range' 0.1.0 (" +
                kBad +
                "/libviwo_update_range.so) of version 1, 24 bytes - build both with the same "
                "definition of them");
}

const std::string kMoody =
    "sensors:\n  s: {type: planar_simulator, motion: straight, duration_s: 2, robot: {type: "
    "moody}}\n";

TEST(FailingModel, EndsARunOfTheWheelsAlone) {
  RunSetup setup =
      read_run(config::parse(kMoody + "kinematics: {type: moody, mood: rows_std}\n", "run.yaml"),
               registry(), 1);
  const RunData data = collect(setup);
  const RunResult result = run(setup, data);
  EXPECT_EQ(result.status, RunStatus::kFailed);
  EXPECT_EQ(result.cause, "kinematics plugin 'moody' 1.2.0 (" + kBad +
                              "/libviwo_kinematics_moody.so) failed in rows: no such row "
                              "(epoch 1)");
  EXPECT_EQ(summary_of(setup, result)["status"], "failed");
  EXPECT_EQ(summary_of(setup, result)["cause"], result.cause);
}

TEST(FailingModel, EndsARunOfTheFilterThroughAnUpdateOfAnotherPlugin) {
  for (const auto& [mood, text] :
       {std::pair("rows_std", "no such row"),
        std::pair("rows_int", "threw something that is not a std::exception"),
        std::pair("rows_input", "the sample is wrong")}) {
    RunSetup setup = read_run(
        config::parse(
            "sensors:\n  s: {type: simulator, motion: straight, duration_s: 2, features: 0, "
            "robot: {type: moody}}\nkinematics: {type: moody, mood: " +
                std::string(mood) + "}\nupdates: {wheel_odometry: {}}\n",
            "run.yaml"),
        registry(), 1);
    const RunData data = collect(setup);
    const RunResult result = run(setup, data);
    EXPECT_EQ(result.status, RunStatus::kFailed);
    EXPECT_EQ(result.cause.substr(0, result.cause.rfind(" (epoch")),
              "kinematics plugin 'moody' 1.2.0 (" + kBad +
                  "/libviwo_kinematics_moody.so) failed in rows: " + text);
    EXPECT_EQ(summary_of(setup, result)["cause"], result.cause);
  }
}

}  // namespace
}  // namespace viwo
