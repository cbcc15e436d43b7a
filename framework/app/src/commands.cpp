// The commands that run something.
#include <algorithm>
#include <iostream>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "command_line.hpp"
#include "estimate_output.hpp"
#include "forecast_output.hpp"
#include "interrupt.hpp"
#include "live_output.hpp"
#include "own_inputs.hpp"
#include "progress.hpp"
#include "viwo/calibration/calibrate.hpp"
#include "viwo/calibration_report/calibration_output.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/experiment/experiment.hpp"
#include "viwo/files/files.hpp"
#include "viwo/files/folder_lock.hpp"
#include "viwo/inspect/inspection.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/observability/observability.hpp"
#include "viwo/plan/plan.hpp"
#include "viwo/report/figures.hpp"
#include "viwo/results/run_output.hpp"
#include "viwo/run/simulate.hpp"
#include "viwo/setup/configuration.hpp"
#include "viwo/setup/input_files.hpp"
#include "viwo/view/pictures.hpp"

namespace viwo::app {
namespace {

using namespace experiment;
using files::make_folder;
using files::write_text;

/// The folder asked for, or results/<name of the configuration file>; what makes no run of it has
/// its own, with the name of the `command` behind.
std::filesystem::path out_folder(const Arguments& arguments, const std::string& command = "") {
  if (arguments.out) return *arguments.out;
  std::filesystem::path name = std::filesystem::path(arguments.positional[0]).stem();
  if (!command.empty()) name += "_" + command;
  return "results" / name;
}

/// It is made, and belongs to this command: whether results can be written shows before the work.
class OutFolder {
 public:
  explicit OutFolder(std::filesystem::path folder)
      : folder_(made(std::move(folder))), lock_(folder_, false) {}
  const std::filesystem::path& path() const { return folder_; }

 private:
  static std::filesystem::path made(std::filesystem::path folder) {
    make_folder(folder);
    return folder;
  }

  std::filesystem::path folder_;
  files::FolderLock lock_;
};

/// --figures: the plots of a page, beside it.
class Figures {
 public:
  /// Throws InputError when they are wanted and cannot be drawn, before any work.
  Figures(const Arguments& arguments, const std::filesystem::path& folder)
      : wanted_(!arguments.figures.empty()),
        format_(arguments.figures == "pdf" ? report::FigureFormat::kPdf
                                           : report::FigureFormat::kSvg),
        folder_(folder / "figures") {
    if (!wanted_) return;
    files::make_folder_in(folder, "figures");
    report::write_figures(folder_, {}, format_);
  }
  void write(const report::Document& document) const {
    if (wanted_) report::write_figures(folder_, document, format_);
  }

 private:
  bool wanted_;
  report::FigureFormat format_;
  std::filesystem::path folder_;
};

/// Whether the sensor of a section has a parameter `lockstep`. What is wrong with the section is
/// said by who reads it.
bool can_be_played(const config::Node& section, PluginRegistry& plugins) {
  const config::Node* const type = section.find("type");
  if (type == nullptr || !type->is_scalar()) return false;
  try {
    const auto params = plugins.find("sensor", type->scalar()).params;
    return std::any_of(params.begin(), params.end(), [](const ParamSpec& param) {
      return std::string_view(param.name) == "lockstep";
    });
  } catch (const InputError&) {
    return false;
  }
}

/// --lockstep: sets that parameter wherever there is one.
void play_in_step(config::Node& configuration, PluginRegistry& plugins) {
  config::Node* const sensors = configuration.find("sensors");
  bool any = false;
  if (sensors != nullptr) {
    for (config::Node::Entry& entry : sensors->entries()) {
      if (!can_be_played(entry.value, plugins)) continue;
      any = true;
      entry.value.set("lockstep", config::Node::scalar_of("true"));
    }
  }
  if (!any) throw InputError("--lockstep: no sensor of this run can be played in step");
}

config::Node configuration_of(const Arguments& arguments) {
  return resolve_placeholders(
      load_run_configuration(arguments.positional[0], arguments.assignments));
}

RunSetup read_run_of(const Arguments& arguments, PluginRegistry& plugins) {
  config::Node configuration = configuration_of(arguments);
  if (arguments.lockstep) play_in_step(configuration, plugins);
  return read_run(configuration, plugins, arguments.seed);
}

/// As it stands: what a log is compared with does not depend on a seed.
RunSetup read_without_drawn_start(const Arguments& arguments, PluginRegistry& plugins) {
  constexpr std::string_view kScale = "estimator.calibration_error_scale";
  config::Node configuration = configuration_of(arguments);
  config::Node* const scale = configuration.at_path(kScale);
  if (scale == nullptr) return read_run(configuration, plugins, arguments.seed);
  const config::Node drawn = std::exchange(*scale, config::Node::scalar_of("0", scale->mark()));
  RunSetup setup = read_run(configuration, plugins, arguments.seed);
  *setup.resolved.at_path(kScale) = drawn;  // for --fix
  return setup;
}

/// The files of a plan, and of all else that a run reads or writes, are different ones.
void keep_files_of_run(const Arguments& arguments, const RunSetup& setup) {
  const std::filesystem::path folder = out_folder(arguments);
  Files inputs = inputs_of(arguments, setup);
  if (!arguments.plan.empty()) inputs.push_back(arguments.plan);
  keep_inputs_of_run(folder, inputs);
  keep_apart("--video", arguments.video, folder, kResultsOfRun, inputs);
  keep_apart("--mcap", arguments.mcap, folder, kResultsOfRun, inputs, arguments.video);
}

/// The results of a shard wait for those of the others.
int shard_is_done(const ExperimentResult& result, const Shard& shard, const std::string& file,
                  const std::filesystem::path& folder) {
  std::size_t cells = 0, bad = 0;
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    if (!shard.has(i)) continue;
    ++cells;
    if (result.runs[i].result.status != RunStatus::kOk) ++bad;
  }
  std::cout << "shard " << shard.index << " of " << shard.count << ": " << cells << " of "
            << result.runs.size() << " runs are in " << (folder / "journal").string() << ", " << bad
            << " of them failed or diverged; when all shards are done, with the same --seeds and "
               "--set:\n  viwo experiment "
            << file << " --out " << folder.string() << " --collect\n";
  return bad == 0 ? 0 : 1;
}

}  // namespace

int run_command(const Arguments& arguments) {
  PluginRegistry plugins = make_registry(arguments);
  RunSetup setup = read_run_of(arguments, plugins);
  keep_files_of_run(arguments, setup);
  std::optional<ForecastOutput> forecast;
  if (!arguments.plan.empty()) forecast.emplace(arguments.plan, setup, plugins);
  view::PictureSinks sinks = view::open_sinks(setup, arguments.show, arguments.video);
  const RunData data = collect(setup, LiveSensors::kAllowed);
  view::RunPictures pictures(setup, data, std::move(sinks));
  const OutFolder out(out_folder(arguments));
  const std::filesystem::path& folder = out.path();
  const Figures figures(arguments, folder);
  std::optional<EstimateOutput> mcap;  // behind what else may be refused: it empties its file
  if (!arguments.mcap.empty()) mcap.emplace(arguments.mcap, setup);
  // Until all is written. What has no filter is done in no time.
  std::optional<InterruptSignal> interrupt;
  if (setup.filter) interrupt.emplace();
  std::optional<LiveOutput> output;
  RunResult result;
  {
    TimeProgress progress(setup.name);  // gone before anything else is printed
    RunHooks hooks;
    pictures.watch(hooks);
    hooks.progress = [&](double fraction) { progress.at(fraction); };
    hooks.interrupted = [&] { return interrupt && interrupt->raised(); };
    if (data.is_live()) output.emplace(setup, folder, hooks);
    if (forecast) forecast->watch(hooks, data.is_live());
    if (mcap) mcap->watch(hooks);
    result = viwo::run(setup, data, hooks);
    if (output) output->finish(result);
  }
  const std::string picture_failure = pictures.finish(result);
  const std::string mcap_failure = mcap ? mcap->finish(result) : "";
  const std::string said = describe(result);
  // A live run cannot be made again: this is known of it, whatever becomes of its files.
  if (data.is_live()) std::cout << said << std::flush;
  write_run(folder, setup, result);
  if (!data.is_live()) std::cout << said;
  if (forecast) std::cout << "forecast: " << forecast->text() << "\n";
  std::cout << "report: " << (folder / "report.html").string() << std::endl;
  figures.write(report_of(setup, result));
  if (!picture_failure.empty()) throw std::runtime_error(picture_failure);
  if (!mcap_failure.empty()) throw std::runtime_error(mcap_failure);
  return is_trusted(result) ? 0 : 1;
}

int experiment_command(const Arguments& arguments) {
  PluginRegistry plugins = make_registry(arguments);
  ExperimentOptions options;
  options.jobs = arguments.jobs;
  options.seeds = arguments.seeds;
  options.keep_runs = arguments.keep_runs;
  options.assignments = arguments.assignments;
  options.resume = arguments.resume;
  options.collect = arguments.collect;
  if (arguments.shard) options.shard = read_shard(*arguments.shard);
  const InterruptSignal interrupt;
  options.interrupted = [&interrupt] { return interrupt.raised(); };
  const ExperimentSetup setup = read_experiment(arguments.positional[0], options);
  const auto folder = out_folder(arguments);
  keep_inputs(folder, kResults, {arguments.positional[0]});  // those of its runs when they are read
  std::optional<files::FolderLock> lock;
  options.folder_is_there = [&] { lock.emplace(folder, options.shard.has_value()); };
  const Figures figures(arguments, folder);
  const ExperimentResult result = [&] {
    Progress progress;  // gone before anything else is printed
    options.progress = &progress;
    return run_experiment(setup, options, plugins, folder);
  }();
  if (options.shard) return shard_is_done(result, *options.shard, arguments.positional[0], folder);
  write_experiment(folder, result);
  std::cout << describe(result) << "\n"
            << result.runs.size() << " runs in " << significant(result.wall_s, 3)
            << " s; report: " << (folder / "report.html").string() << std::endl;
  figures.write(report_of(result));
  for (const ExperimentRun& run : result.runs) {
    if (run.result.status != RunStatus::kOk) return 1;
  }
  return 0;
}

int observability_command(const Arguments& arguments) {
  PluginRegistry plugins = make_registry(arguments);
  ExperimentOptions options;
  options.assignments = arguments.assignments;
  const ExperimentSetup setup = observability::read_observability(arguments.positional[0], options);
  const std::filesystem::path folder = out_folder(arguments, "observability");
  keep_inputs(folder, {"observability.json", "report.html"}, inputs_of(arguments, setup));
  const OutFolder out(folder);
  const Figures figures(arguments, folder);
  const observability::ObservabilityReport report = [&] {
    Progress progress;
    return observability::analyse(setup, plugins, progress);
  }();
  write_observability(folder, report);
  std::cout << describe(report) << "\n"
            << report.results.size() << " analyses in " << significant(report.wall_s, 3)
            << " s; report: " << (folder / "report.html").string() << std::endl;
  figures.write(report_of(report));
  return 0;
}

int calibrate_command(const Arguments& arguments) {
  PluginRegistry plugins = make_registry(arguments);
  calibration::CalibrationSetup setup =
      calibration::read_calibration_setup(arguments.positional[0], arguments.assignments, plugins);
  for (const calibration::CalibrationRecording& recording : setup.recordings) {
    Files inputs = inputs_of(arguments, recording.setup);
    inputs.emplace_back(recording.run.mark().file);
    keep_inputs(out_folder(arguments, "calibrate"), calibration::kResults, inputs);
  }
  const OutFolder out(out_folder(arguments, "calibrate"));
  const std::filesystem::path& folder = out.path();
  const calibration::CalibrationResult result = [&] {
    Progress progress;
    return calibrate(setup, progress);
  }();
  write_calibration(folder, result);
  std::cout << describe(result) << "\ncalibration: " << (folder / "calibration.yaml").string()
            << "\nreport: " << (folder / "report.html").string() << "\n";
  return result.is_trusted() ? 0 : 1;
}

int plan_command(const Arguments& arguments) {
  PluginRegistry plugins = make_registry(arguments);
  const plan::PlanSetup setup =
      plan::read_plan_setup(arguments.positional[0], arguments.assignments, plugins);
  Files inputs = input_files(setup.kinematics.resolved);
  inputs.emplace_back(arguments.positional[0]);
  keep_inputs(out_folder(arguments, "plan"), plan::kResults, inputs);
  const plan::Plan found = plan::make_plan(setup);
  const OutFolder out(out_folder(arguments, "plan"));
  const std::filesystem::path& folder = out.path();
  write_plan(folder, setup, found);
  std::cout << describe(setup, found) << "motion: " << (folder / "plan.csv").string()
            << "\nreport: " << (folder / "report.html").string() << "\n";
  return found.reached ? 0 : 1;
}

int inspect_command(const Arguments& arguments) {
  std::error_code none;  // of a file that is not there
  if (std::filesystem::equivalent(arguments.fix, arguments.positional[0], none)) {
    throw InputError("--fix " + arguments.fix.string() +
                     ": is the configuration itself, whose comments and placeholders would be "
                     "lost: name another file");
  }
  PluginRegistry plugins = make_registry(arguments);
  RunSetup setup = read_without_drawn_start(arguments, plugins);
  const std::filesystem::path folder = out_folder(arguments, "inspect");
  const Files inputs = inputs_of(arguments, setup);
  keep_inputs(folder, inspect::kResults, inputs);
  keep_apart("--fix", arguments.fix, folder, inspect::kResults, inputs);
  const OutFolder out(folder);
  const inspect::Inspection inspection = inspect::inspect(setup);
  write_inspection(folder, inspection);
  std::cout << describe(inspection) << "report: " << (folder / "report.html").string() << "\n";
  if (!arguments.fix.empty()) {
    write_text(arguments.fix, fixed_configuration(setup, inspection, plugins),
               files::Appears::kWholeBesideOthers);
    std::cout << "configuration: " << arguments.fix.string() << "\n";
  }
  return inspection.has_faults() ? 1 : 0;
}

int simulate_command(const Arguments& arguments) {
  PluginRegistry plugins = make_registry(arguments);
  RunSetup setup = read_run_of(arguments, plugins);
  if (std::filesystem::is_regular_file(*arguments.out)) {
    throw InputError(arguments.out->string() + "  is a file, not a folder");
  }
  refuse_to_empty(*arguments.out, inputs_of(arguments, setup));
  const OutFolder out(*arguments.out);
  const SimulateResult result = write_log(setup, *arguments.out);
  std::cout << describe(result) << " in " << arguments.out->string() << "\n";
  return 0;
}

}  // namespace viwo::app
