// Experiments: variants x recordings x seeds of one run configuration, side by side.
#pragma once

#include <filesystem>
#include <functional>
#include <initializer_list>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "viwo/experiment/shard.hpp"
#include "viwo/report/document.hpp"
#include "viwo/run/run.hpp"
#include "viwo/run/work_progress.hpp"
#include "viwo/setup/configuration.hpp"

namespace viwo::experiment {

struct Variant {
  std::string name;
  config::Node overrides;
};

/// An experiment file, read, with its base configuration.
struct ExperimentSetup {
  std::string name;
  std::filesystem::path base_file;
  config::Node base;  ///< run configuration with placeholders
  std::vector<Variant> variants;
  std::vector<Recording> recordings;
  int seeds = 1;
  std::vector<std::string> report_by;  ///< labels over which the tables are broken down
  std::size_t baseline = 0;            ///< variant that the others are compared with
};

struct ExperimentOptions {
  int jobs = 0;                          ///< runs in parallel; 0: one per core
  std::optional<int> seeds;              ///< overrules the file
  bool keep_runs = false;                ///< one folder per run
  std::vector<std::string> assignments;  ///< --set, applied to the base configuration
  bool resume = false;                   ///< take over the runs of an interrupted experiment
  /// Only its cells, which stay in the journal; those that are there are taken over.
  std::optional<Shard> shard;
  WorkProgress* progress = &no_progress();  ///< told of runs that are done
  bool collect = false;                     ///< run nothing: all cells are taken from the journal
  /// Told once that the folder of the results is there, before anything in it is read or written.
  std::function<void()> folder_is_there;
  /// Asked from any thread, often; once it says true the experiment ends as soon as it can.
  std::function<bool()> interrupted;
};

/// The experiment was interrupted: how far it came and how to continue.
class Interrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One cell of the experiment.
struct ExperimentRun {
  std::size_t variant = 0;
  std::size_t recording = 0;
  std::uint64_t seed = 1;
  RunResult result;         ///< its series thinned; of 1000 runs and more only drawn ones
  bool taken_over = false;  ///< from the journal of an interrupted experiment
};

/// Whether the page draws its series: those of the first six seeds.
inline bool is_drawn(const ExperimentSetup& setup, const ExperimentRun& run) {
  return setup.seeds == 1 || run.seed <= 6;
}

struct ExperimentResult {
  ExperimentSetup setup;
  std::vector<ExperimentRun> runs;  ///< by variant, recording, seed
  int jobs = 1;
  double wall_s = 0.;  ///< without the time of runs that were taken over
  /// "m", "rad", "s" of the calibration parameters, by name.
  std::map<std::string, std::string> units;
};

/// The run configuration of one cell, placeholders replaced. Throws InputError.
config::Node configuration_of(const ExperimentSetup& setup, const Variant& variant,
                              const Recording& recording);

/// Throws InputError.
ExperimentSetup read_experiment(const std::filesystem::path& file,
                                const ExperimentOptions& options);

/// Checks every variant with every recording before the first run starts (InputError), then runs
/// all of them in parallel. A run that fails is kept with its cause and does not stop the others.
/// The result does not depend on the number of jobs, nor on whether the experiment was interrupted
/// and resumed. With keep_runs, each run is written below `folder`/runs.
///
/// With a shard the results of other cells stay as they are made. With `collect` InputError names
/// the cells that the journal does not have.
///
/// Each run that is done is kept in `folder`/journal until write_experiment() has written the
/// results; without a folder there is no journal. Throws Interrupted, and std::runtime_error when
/// something cannot be written.
ExperimentResult run_experiment(const ExperimentSetup& setup, const ExperimentOptions& options,
                                PluginRegistry& plugins, const std::filesystem::path& folder);

/// report.html of an experiment, as a document.
report::Document report_of(const ExperimentResult& result);

/// What an experiment leaves behind.
inline constexpr std::initializer_list<const char*> kResults = {"runs.csv", "summary.json",
                                                                "report.html"};

/// Writes them, then removes the journal.
void write_experiment(const std::filesystem::path& folder, const ExperimentResult& result);

/// The tables of variants (and labels) for the terminal.
std::string describe(const ExperimentResult& result);

}  // namespace viwo::experiment
