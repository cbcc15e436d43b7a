// Every plugin of this build is conformant; sensors that read files have a configuration for it.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "viwo/conformance/conformance.hpp"

namespace viwo::conformance {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> plugins() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(VIWO_TEST_PLUGIN_DIR)) {
    // One cannot be made without a ROS master, the other would join what DDS there is on the
    // network; tests/live have systems of their own.
    const std::string name = entry.path().filename().string();
    if (name == "libviwo_sensor_ros1_topics.so" || name == "libviwo_sensor_ros2_topics.so")
      continue;
    if (entry.path().extension() == ".so") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// "libviwo_kinematics_four_wis_wid.so" as "kinematics_four_wis_wid".
std::string short_name(const fs::path& file) {
  return file.stem().string().substr(std::string("libviwo_").size());
}

Options options_for(const fs::path& file) {
  Options options;
  const fs::path config = fs::path(VIWO_TEST_SOURCE_DIR) / "framework/conformance/tests/configs" /
                          (short_name(file) + ".yaml");
  if (fs::exists(config)) options.config = config;
  return options;
}

class InTree : public ::testing::TestWithParam<fs::path> {};

TEST_P(InTree, IsConformant) {
  const Conformance result = check_plugin(GetParam(), options_for(GetParam()));
  EXPECT_GE(result.checks.size(), 7u) << "construction did not come about";
  for (const CheckResult& check : result.checks) {
    EXPECT_TRUE(check.passed()) << to_text(check, true);
    EXPECT_TRUE(check.warnings.empty()) << to_text(check, true);
  }
}

INSTANTIATE_TEST_SUITE_P(Plugins, InTree, ::testing::ValuesIn(plugins()),
                         [](const auto& plugin) { return short_name(plugin.param); });

TEST(TwoDrivenWheels, AreConformantWithAWarning) {
  const fs::path config = fs::temp_directory_path() / "viwo_conformance_two_wheels.yaml";
  std::ofstream(config) << "kinematics: {type: four_wis_wid_drive_only, x_m: [0.3, -0.3], "
                           "y_m: [0.2, -0.2], radius_m: [0.1], steer_offset_rad: [0]}\n";
  Options options;
  options.config = config;
  const Conformance result = check_plugin(
      fs::path(VIWO_TEST_PLUGIN_DIR) / "libviwo_kinematics_four_wis_wid_drive_only.so", options);
  std::string warnings;
  for (const CheckResult& check : result.checks) {
    EXPECT_TRUE(check.passed()) << to_text(check, true);
    for (const std::string& warning : check.warnings) warnings += check.name + ": " + warning;
  }
  EXPECT_EQ(warnings,
            "rank of A: A has rank 2 at most: no reading alone tells the whole twist, and the base "
            "needs another source of motion - if that is not meant, check the signs of A");
  fs::remove(config);
}

TEST(Program, SaysWhatItFindsAndEndsWithACode) {
  const std::string program = VIWO_TEST_BINARY_DIR "/bin/viwo_conformance ";
  const auto code = [&](const std::string& arguments) {
    return WEXITSTATUS(std::system((program + arguments + " > /dev/null 2>&1").c_str()));
  };
  const fs::path folder = VIWO_TEST_PLUGIN_DIR;
  EXPECT_EQ(code((folder / "libviwo_kinematics_differential.so").string()), 0);
  EXPECT_EQ(code((folder / "libviwo_sensor_asl_imu.so").string()), 1) << "needs --config";
  EXPECT_EQ(code("/etc/hostname"), 2);
  EXPECT_EQ(code("--no-such-option"), 2);
  EXPECT_EQ(code(""), 2);
  EXPECT_EQ(code("--help"), 0);
}

}  // namespace
}  // namespace viwo::conformance
