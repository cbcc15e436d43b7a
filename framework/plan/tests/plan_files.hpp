// Plan files in memory, and what a drive of a plan is.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "registry.hpp"
#include "viwo/plan/plan.hpp"

namespace viwo::testing {

/// A folder of this test, empty.
inline std::filesystem::path own_folder() {
  const auto* const test = ::testing::UnitTest::GetInstance()->current_test_info();
  const auto folder = std::filesystem::temp_directory_path() /
                      ("viwo_plan_" + std::string(test->test_suite_name()) + "_" + test->name());
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

inline std::filesystem::path written(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
  return file;
}

inline plan::PlanSetup swerve_plan(const std::vector<std::string>& assignments = {}) {
  return plan::read_plan_setup(configuration("plans/swerve.yaml"), assignments, registry());
}

/// Bases that are not like each other, with goals.
inline const std::string kDifferential =
    "kinematics: {type: differential, radius_left_m: 0.05, radius_right_m: 0.05, baseline_m: 0.3, "
    "prior_sigma_radius_m: 0.005, prior_sigma_baseline_m: 0.001}\n"
    "goals: {r_left: 1 %, r_right: 1 %}\n";

inline plan::PlanSetup differential_plan(const std::vector<std::string>& assignments = {}) {
  const auto file = written(own_folder() / "plan.yaml",
                            "plan: differential\nbase_radius_m: 0.25\nfloor_x_m: 4\n"
                            "floor_y_m: 4\n" +
                                kDifferential);
  return plan::read_plan_setup(file, assignments, registry());
}

}  // namespace viwo::testing
