// Experiments: variants x recordings x seeds of one run configuration, side by side.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "viwo/experiment/configuration.hpp"
#include "viwo/experiment/run.hpp"

namespace viwo::experiment {

struct Variant {
  std::string name;
  config::Node overrides;
};

/// An experiment file, read, with its base configuration.
struct ExperimentSetup {
  std::string name;
  config::Node base;  ///< run configuration with placeholders
  std::vector<Variant> variants;
  std::vector<Recording> recordings;
  int seeds = 1;
  std::vector<std::string> report_by;  ///< labels over which the tables are broken down
};

struct ExperimentOptions {
  int jobs = 0;                          ///< runs in parallel; 0: one per core
  std::optional<int> seeds;              ///< overrules the file
  bool keep_runs = false;                ///< one folder per run
  std::vector<std::string> assignments;  ///< --set, applied to the base configuration
};

/// One cell of the experiment.
struct ExperimentRun {
  std::size_t variant = 0;
  std::size_t recording = 0;
  std::uint64_t seed = 1;
  RunResult result;
};

struct ExperimentResult {
  ExperimentSetup setup;
  std::vector<ExperimentRun> runs;  ///< by variant, recording, seed
  double wall_s = 0.;
};

/// Throws InputError.
ExperimentSetup read_experiment(const std::filesystem::path& file,
                                const ExperimentOptions& options);

/// Checks every variant with every recording before the first run starts (InputError), then runs
/// all of them in parallel. A run that fails is kept with its cause and does not stop the others.
/// The result does not depend on the number of jobs. With keep_runs, each run is written below
/// `folder`/runs.
ExperimentResult run_experiment(const ExperimentSetup& setup, const ExperimentOptions& options,
                                PluginRegistry& plugins, const std::filesystem::path& folder);

/// Writes runs.csv, summary.json and report.html.
void write_experiment(const std::filesystem::path& folder, const ExperimentResult& result);

/// The table of variants (and labels) for the terminal.
std::string describe(const ExperimentResult& result);

}  // namespace viwo::experiment
