// The seeds that the kinematic models and updates of a run are made with.
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "viwo/config/yaml.hpp"
#include "viwo/run/run.hpp"

namespace viwo {
namespace {

const std::string kSensors =
    "sensors: {s: {type: planar_simulator, motion: straight, duration_s: 1, robot: {type: moody, "
    "mood: seed}}}\n"
    "estimator: {type: dead_reckoning}\n";  // there is no IMU
const std::string kWheels =
    "kinematics: {type: moody, mood: seed}\n"
    "wheels: {sensor: s}\n"
    "wheel_sets:\n"
    "  second: {kinematics: {type: moody, mood: seed}, wheels: {sensor: s}}\n"
    "  third: {kinematics: {type: moody, mood: seed}, wheels: {sensor: s}}\n";
const std::string kUpdates =
    "updates: {failing: {what: seed}, other: {type: failing, what: seed}}\n";

/// Everything that plugins log while a run is read: their names and seeds.
std::set<std::string> seeds_of(const std::string& run, std::uint64_t seed = 1) {
  std::set<std::string> seeds;
  PluginRegistry plugins({VIWO_TEST_PLUGIN_DIR, VIWO_TEST_BINARY_DIR "/tests/plugins_bad"},
                         [&](const PluginInfo& info, LogLevel, std::string_view text) {
                           seeds.insert(info.name + " " + std::string(text));
                         });
  read_run(config::parse(run, "run.yaml"), plugins, seed);
  return seeds;
}

std::string update(const std::string& name) {
  return "failing " + std::to_string(instance_seed(1, "update", "updates." + name));
}

std::string model(const std::string& path, std::uint64_t seed = 1) {
  return "moody " + std::to_string(instance_seed(seed, "kinematics", path));
}

TEST(Seeds, AreThoseOfTheRunAndOfThePathsOfTheSections) {
  // Each update has an instance for each wheel set; the simulator is the first sensor.
  EXPECT_EQ(seeds_of(kSensors + kWheels + kUpdates),
            (std::set<std::string>{
                model("sensors.s.robot", 1000), model("kinematics"),
                model("wheel_sets.second.kinematics"), model("wheel_sets.third.kinematics"),
                update("failing"), update("second.failing"), update("third.failing"),
                update("other"), update("second.other"), update("third.other")}));
}

TEST(Seeds, DoNotDependOnTheOrderOfSections) {
  const std::string swapped =
      "updates: {other: {type: failing, what: seed}, failing: {what: seed}}\n"
      "wheel_sets:\n"
      "  third: {wheels: {sensor: s}, kinematics: {type: moody, mood: seed}}\n"
      "  second: {wheels: {sensor: s}, kinematics: {type: moody, mood: seed}}\n"
      "wheels: {sensor: s}\n"
      "kinematics: {type: moody, mood: seed}\n";
  EXPECT_EQ(seeds_of(swapped + kSensors), seeds_of(kSensors + kWheels + kUpdates));
}

TEST(Seeds, AreAllOthersInARunWithAnotherSeed) {
  std::set<std::string> both = seeds_of(kSensors + kWheels + kUpdates, 1);
  both.merge(seeds_of(kSensors + kWheels + kUpdates, 2));
  EXPECT_EQ(both.size(), 20u);
}

}  // namespace
}  // namespace viwo
