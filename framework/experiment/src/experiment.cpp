#include "viwo/experiment/experiment.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <iterator>
#include <mutex>
#include <set>

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "run_identity.hpp"
#include "run_journal.hpp"
#include "viwo/files/files.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/results/keep_inputs.hpp"
#include "viwo/results/run_output.hpp"
#include "viwo/run/parallel_for.hpp"
#include "viwo/run/thin.hpp"
#include "viwo/setup/input_files.hpp"

namespace viwo::experiment {
namespace {

using config::Node;

/// Variant, recording and seed.
std::string title_of(const ExperimentSetup& setup, const ExperimentRun& run) {
  std::string line = setup.variants[run.variant].name;
  const Recording& recording = setup.recordings[run.recording];
  if (!recording.name.empty()) line += "  " + recording.name;
  for (const std::string& label : setup.report_by) {
    if (const auto found = recording.labels.find(label); found != recording.labels.end()) {
      line += " (" + found->second + ")";
    }
  }
  if (setup.seeds > 1) line += "  seed " + std::to_string(run.seed);
  return line;
}

std::string line_of(const ExperimentSetup& setup, const ExperimentRun& run) {
  std::string line = title_of(setup, run);
  line += std::string("  ") + status_text(run.result);
  if (const std::string why = reason(run.result); !why.empty()) line += ": " + why;
  if (std::isfinite(run.result.nees.pose)) {
    line += "  NEES " + significant(run.result.nees.pose, 3);
  }
  if (run.result.accuracy) {
    line += "  end error " + significant(1e3 * run.result.accuracy->end_m, 4) + " mm, " +
            significant(run.result.accuracy->end_yaw_deg, 3) + " deg yaw";
  }
  return line;
}

/// Above it the series of runs that are not drawn would need more memory than all the rest.
constexpr std::size_t kManyRuns = 1000;

/// The folder of what keep_runs keeps.
constexpr const char* kRuns = "runs";

/// Thrown out of a run that the user does not wait for any more.
struct Stopped {};

/// The runs of an experiment, one at a time.
class Runner {
 public:
  Runner(const ExperimentOptions& options, PluginRegistry& plugins,
         const std::filesystem::path& folder, ExperimentResult& result)
      : setup_(result.setup),
        options_(options),
        plugins_(plugins),
        folder_(folder),
        journal_(folder),
        identity_(folder),
        result_(result) {}

  /// Wrong input is found here, before anything has run: sensors read their logs when made. A shard
  /// looks only at what it runs.
  void check() {
    const auto seeds = static_cast<std::size_t>(setup_.seeds);
    for (std::size_t v = 0; v < setup_.variants.size(); ++v) {
      for (std::size_t r = 0; r < setup_.recordings.size(); ++r) {
        const std::size_t first = result_.runs.size();
        int mine = 0;
        for (std::size_t s = 0; s < seeds; ++s) {
          result_.runs.push_back({v, r, s + 1, {}});
          mine += is_mine(first + s) ? 1 : 0;
        }
        configurations_.emplace_back();
        if (mine == 0) continue;
        cells_ += mine;
        const RunSetup check = read(v, r);
        configurations_.back() = identity_.of(check);
        if (seeds == 1) result_.runs[first].seed = check.seed;
        if (stopped()) throw Interrupted("interrupted before the first run");
      }
    }
    if (options_.keep_runs) require_own_folders();
  }

  /// Takes over what the journal has, or throws it away.
  void open_journal(WorkProgress& progress) {
    if (!folder_.empty()) journal_.require_own_folder();
    const int there = folder_.empty() ? 0 : journal_.size();
    if (options_.shard) journal_.keep_for_shards();
    if (there == 0) return;
    if (!options_.resume && !options_.shard && !options_.collect) {
      if (journal_.is_of_shards()) {
        throw InputError("there are " + std::to_string(there) + " runs of shards in " +
                         journal_.folder().string() +
                         ": --collect makes the results of them, --resume runs what is missing; "
                         "remove that folder to begin anew");
      }
      journal_.remove();
      progress.note(std::to_string(there) +
                    " runs of an interrupted experiment are discarded (not --resume): " +
                    journal_.folder().string());
      return;
    }
    int taken = 0, failed = 0, others = 0;
    for (std::size_t i = 0; i < result_.runs.size(); ++i) {
      ExperimentRun& run = result_.runs[i];
      if (!is_mine(i)) continue;
      std::optional<RunResult> kept = journal_.read(key_of(run));
      if (!kept) {
        others += journal_.has(key_of(run)) ? 1 : 0;
        continue;
      }
      // A run that failed may do better once its cause is mended.
      if (kept->status == RunStatus::kFailed && !options_.collect) {
        ++failed;
        continue;
      }
      // What failed before it was a run has left none.
      const bool wants_folder = options_.keep_runs && kept->status != RunStatus::kFailed;
      if (wants_folder && !exists(run_folder(run) / "summary.json")) continue;
      run.result = std::move(*kept);
      run.taken_over = true;
      ++taken;
    }
    finished_ = taken;
    const std::string of = " of " + std::to_string(cells_);
    progress.skipped(
        taken, std::to_string(taken) + of + " runs " +
                   (options_.collect ? "are there" : "taken over from an interrupted experiment"));
    if (options_.shard && others > 0) {
      progress.note(std::to_string(others) + " runs in " + journal_.folder().string() +
                    " are damaged, or of another configuration, program or version: replaced");
    }
    if (failed > 0) progress.note(std::to_string(failed) + " runs that failed are run again");
    if (!options_.shard && there > taken + failed) {
      progress.note(
          std::to_string(there - taken - failed) + " of " + std::to_string(there) + " files in " +
          journal_.folder().string() +
          " are not used: damaged, of another configuration, seed, program or version, or without "
          "the folder that --keep-runs wants");
    }
  }

  /// InputError for what collect() has not found.
  void require_all() const {
    constexpr int kNamed = 10;
    const int missing = cells_ - finished_;
    if (missing == 0) return;
    std::string text = std::to_string(missing) + " of " + std::to_string(cells_) +
                       " runs are not in " + journal_.folder().string() + ":";
    int named = 0;
    for (std::size_t i = 0; i < result_.runs.size() && named < kNamed; ++i) {
      if (result_.runs[i].taken_over) continue;
      text += "\n  " + std::to_string(i) + "  " + title_of(setup_, result_.runs[i]);
      ++named;
    }
    if (missing > named) text += "\n  and " + std::to_string(missing - named) + " more";
    throw InputError(text + "\nrun their shards again (cell k is in shard k mod N), then collect");
  }

  /// Runs a cell; false if that was interrupted.
  bool run(ExperimentRun& run, WorkProgress& progress) {
    if (stopped()) return false;
    try {
      RunSetup setup = read_run(configuration(run.variant, run.recording), plugins_, run.seed);
      RunHooks hooks;
      hooks.progress = [this](double) {
        if (stopped()) throw Stopped();
      };
      hooks.on_warning = [&](double t_s, const std::string& text) {
        if (!is_new(run, text)) return;
        progress.note(title_of(setup_, run) + ": at " + significant(t_s, 4) + " s: " + text);
      };
      run.result = viwo::run(setup, collect(setup), hooks);
      write_run_of(run, setup);
    } catch (const Stopped&) {
      return false;
    } catch (const Unwritable& error) {
      throw std::runtime_error(error.text);
    } catch (const std::exception& error) {
      fail(run, error.what());
    } catch (...) {
      fail(run, "something was thrown that is not a std::exception");
    }
    thin(run.result);
    if (result_.runs.size() > kManyRuns && !is_drawn(setup_, run)) keep_ends(run.result);
    if (!folder_.empty()) journal_.write(key_of(run), run.result);
    ++finished_;
    return true;
  }

  bool stopped() const { return options_.interrupted && options_.interrupted(); }
  bool is_mine(std::size_t cell) const { return !options_.shard || options_.shard->has(cell); }
  int cells() const { return cells_; }
  int finished() const { return finished_; }

 private:
  /// With its data read once, that what is wrong in them shows; InputError names the recording.
  RunSetup read(std::size_t variant, std::size_t recording) {
    const Node run = configuration(variant, recording);
    return of_recording(setup_.recordings[recording], [&] {
      RunSetup setup = read_run(run, plugins_);
      if (!folder_.empty()) keep_inputs_of(setup);
      const bool is_new_variant = variants_read_.insert(variant).second;
      const bool is_new_recording = recordings_read_.insert(recording).second;
      if (!options_.collect && (is_new_variant || is_new_recording)) collect(setup);
      return setup;
    });
  }

  /// InputError for what is read and would be lost: to a result, or with what stood in its place.
  void keep_inputs_of(const RunSetup& run) const {
    std::vector<std::filesystem::path> inputs = input_files(run);
    inputs.emplace_back(setup_.base.mark().file);
    keep_inputs(folder_, kResults, inputs);
    if (options_.keep_runs) refuse_to_empty(folder_ / kRuns, inputs);
  }

  /// Results that cannot be written are no fault of the run.
  struct Unwritable {
    std::string text;
  };

  void require_own_folders() const {
    std::set<std::filesystem::path> folders;
    for (const ExperimentRun& run : result_.runs) {
      if (folders.insert(run_folder(run)).second) continue;
      throw InputError("--keep-runs: two runs would be kept in " + run_folder(run).string() +
                       ", made of the names of variant and recording - rename one of them");
    }
  }

  /// Whether a warning is the first of its kind, whatever its numbers, of a variant.
  bool is_new(const ExperimentRun& run, const std::string& text) {
    std::string kind = std::to_string(run.variant) + ":";
    std::copy_if(text.begin(), text.end(), std::back_inserter(kind),
                 [](char c) { return c < '0' || c > '9'; });
    const std::scoped_lock lock(said_mutex_);
    return said_.insert(kind).second;
  }

  static void fail(ExperimentRun& run, const std::string& cause) {
    run.result = {};
    run.result.status = RunStatus::kFailed;
    run.result.cause = cause;
  }

  Node configuration(std::size_t variant, std::size_t recording) const {
    return configuration_of(setup_, setup_.variants[variant], setup_.recordings[recording]);
  }

  RunKey key_of(const ExperimentRun& run) const {
    return {setup_.variants[run.variant].name, setup_.recordings[run.recording].name, run.seed,
            configurations_[run.variant * setup_.recordings.size() + run.recording]};
  }

  std::filesystem::path run_folder(const ExperimentRun& run) const {
    const std::string& recording = setup_.recordings[run.recording].name;
    std::string name = setup_.variants[run.variant].name;
    if (!recording.empty()) name += "_" + recording;
    if (setup_.seeds > 1) name += "_" + std::to_string(run.seed);
    return folder_ / kRuns / name;
  }

  void write_run_of(const ExperimentRun& run, const RunSetup& setup) const {
    if (!options_.keep_runs) return;
    try {
      const std::filesystem::path folder = run_folder(run);
      files::require_no_link(folder.parent_path());
      files::require_no_link(folder);
      write_run(folder, setup, run.result);
    } catch (const std::exception& error) {
      throw Unwritable{error.what()};
    }
  }

  const ExperimentSetup& setup_;
  const ExperimentOptions& options_;
  PluginRegistry& plugins_;
  std::filesystem::path folder_;
  RunJournal journal_;
  RunIdentity identity_;
  ExperimentResult& result_;
  std::vector<std::string> configurations_;  // by variant, recording
  std::set<std::size_t> variants_read_, recordings_read_;
  int cells_ = 0;  // that are run or collected here
  std::atomic<int> finished_ = 0;
  std::mutex said_mutex_;
  std::set<std::string> said_;  ///< kinds of warnings
};

}  // namespace

ExperimentResult run_experiment(const ExperimentSetup& setup, const ExperimentOptions& options,
                                PluginRegistry& plugins, const std::filesystem::path& folder) {
  ExperimentResult result;
  result.setup = setup;
  Runner runner(options, plugins, folder, result);
  runner.check();
  // Whether results can be written shows before the work, too.
  if (!folder.empty()) files::make_folder(folder);
  if (options.folder_is_there) options.folder_is_there();
  const auto begin = std::chrono::steady_clock::now();
  result.jobs = options.jobs > 0 ? options.jobs : tbb::this_task_arena::max_concurrency();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(result.jobs));
  WorkProgress& progress = *options.progress;
  progress.begin(setup.name, runner.cells());
  runner.open_journal(progress);
  if (options.collect) runner.require_all();
  parallel_for(result.runs.size(), [&](std::size_t i) {
    ExperimentRun& run = result.runs[i];
    if (run.taken_over || !runner.is_mine(i)) return;
    if (runner.run(run, progress)) progress.done(line_of(setup, run));
  });
  if (runner.finished() < runner.cells()) {
    throw Interrupted("interrupted after " + std::to_string(runner.finished()) + " of " +
                      std::to_string(runner.cells()) + " runs" +
                      (folder.empty()  ? ""
                       : options.shard ? "; the same command continues"
                                       : "; continue with --resume"));
  }
  for (const ExperimentRun& run : result.runs) {
    for (const CalibrationTrack& track : run.result.calibration) {
      result.units[track.name] = track.unit;
    }
  }
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace viwo::experiment
