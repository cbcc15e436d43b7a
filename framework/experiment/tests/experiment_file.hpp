// A folder with a small experiment of dead reckoning in simulation.
#pragma once

#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "in_folder.hpp"
#include "simulated.hpp"
#include "told.hpp"
#include "viwo/experiment/experiment.hpp"

namespace viwo::testing {

class ExperimentFile : public InFolder {
 protected:
  void SetUp() override { InFolder::write("run.yaml", config::to_yaml(simulated("'{motion}'"))); }

  std::filesystem::path write(const std::string& text) const {
    return InFolder::write("experiment.yaml", text);
  }

  /// Writes the results as if every computation had taken no time.
  static void write_without_times(experiment::ExperimentResult result,
                                  const std::filesystem::path& out) {
    result.wall_s = 0.;
    for (experiment::ExperimentRun& cell : result.runs) {
      cell.result.wall_s = 0.;
      cell.result.total_ms = {};
      for (auto& [t_s, ms] : cell.result.epoch_ms) ms = 0.;
      for (auto& [name, time] : cell.result.stages) time = {};
    }
    write_experiment(out, result);
  }
};

inline constexpr const char* kVariants =
    "experiment: test\nbase: run.yaml\nseeds: 2\nmotions: [circle, lateral]\n"
    "variants:\n  redundant:\n  drive_only: {kinematics.type: four_wis_wid_drive_only}\n";

}  // namespace viwo::testing
