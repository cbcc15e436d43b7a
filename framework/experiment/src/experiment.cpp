#include "viwo/experiment/experiment.hpp"

#include <array>
#include <chrono>
#include <cmath>

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "viwo/config/overrides.hpp"
#include "viwo/config/params.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/experiment/output.hpp"
#include "viwo/experiment/progress.hpp"

namespace viwo::experiment {
namespace {

using config::Node;

constexpr std::array kExperimentParams{
    ParamSpec{.name = "experiment", .type = ParamType::kString, .help = "name of the experiment"},
    ParamSpec{.name = "base",
              .type = ParamType::kString,
              .help = "run configuration, relative to this file"},
    ParamSpec{.name = "seeds",
              .type = ParamType::kInt,
              .fallback = "1",
              .min = 1.,
              .help = "runs of each variant and recording, with seeds 1, 2, ..."},
    ParamSpec{.name = "report_by",
              .type = ParamType::kStrings,
              .fallback = "[]",
              .help = "labels of the recordings to break the tables down by"},
};

void read_variants(const Node& file, ExperimentSetup& setup) {
  const Node* variants = file.find("variants");
  if (variants == nullptr || !variants->is_map() || variants->entries().empty()) {
    config::fail(variants != nullptr ? variants->mark() : file.mark(),
                 "'variants' must be a section with at least one variant: NAME: {overrides}");
  }
  for (const auto& entry : variants->entries()) {
    if (!entry.value.is_map() && !entry.value.is_null()) {
      config::fail(entry.value.mark(),
                   "variant '" + entry.key + "' must be a section of overrides");
    }
    require_file_name(entry.key, entry.key_mark);
    setup.variants.push_back({entry.key, entry.value});
  }
}

/// The run configuration of one cell, placeholders replaced.
Node configuration_of(const ExperimentSetup& setup, const Variant& variant,
                      const Recording& recording) {
  Node run = setup.base;
  config::merge(run, variant.overrides);
  Node resolved = resolve_placeholders(run, recording.labels);
  resolved.set(
      "name", Node::scalar_of(variant.name + (recording.name.empty() ? "" : "_" + recording.name)));
  return resolved;
}

std::string line_of(const ExperimentSetup& setup, const ExperimentRun& run) {
  std::string line = setup.variants[run.variant].name;
  const Recording& recording = setup.recordings[run.recording];
  if (!recording.name.empty()) line += "  " + recording.name;
  for (const std::string& label : setup.report_by) {
    if (const auto found = recording.labels.find(label); found != recording.labels.end()) {
      line += " (" + found->second + ")";
    }
  }
  if (setup.seeds > 1) line += "  seed " + std::to_string(run.seed);
  line += std::string("  ") + name(run.result.status);
  if (!run.result.cause.empty()) line += ": " + run.result.cause;
  if (std::isfinite(run.result.nees.pose)) {
    line += "  NEES " + significant(run.result.nees.pose, 3);
  }
  if (run.result.accuracy) {
    line += "  end error " + significant(1e3 * run.result.accuracy->end_m, 4) + " mm, " +
            significant(run.result.accuracy->end_yaw_deg, 3) + " deg yaw";
  }
  return line;
}

}  // namespace

ExperimentSetup read_experiment(const std::filesystem::path& path,
                                const ExperimentOptions& options) {
  const Node file = config::load_file(path);
  config::Errors errors;
  constexpr std::string_view kSections[] = {"variants", "recordings", "motions", "set"};
  const ParamSet params = config::read_params(file, file.mark(), "experiment", kExperimentParams,
                                              kSections, {}, errors);
  errors.throw_if_any();
  ExperimentSetup setup;
  setup.name = params.text("experiment");
  setup.seeds = options.seeds.value_or(static_cast<int>(params.integer("seeds")));
  if (setup.seeds < 1) throw InputError("--seeds must be at least 1");
  const auto report_by = params.texts("report_by");
  setup.report_by.assign(report_by.begin(), report_by.end());
  setup.base = load_base(file, options.assignments);
  setup.recordings = read_recordings(file);
  require_labels(setup.report_by, setup.recordings, file, "report_by");
  read_variants(file, setup);
  return setup;
}

ExperimentResult run_experiment(const ExperimentSetup& setup, const ExperimentOptions& options,
                                PluginRegistry& plugins, const std::filesystem::path& folder) {
  ExperimentResult result;
  result.setup = setup;
  for (std::size_t v = 0; v < setup.variants.size(); ++v) {
    for (std::size_t r = 0; r < setup.recordings.size(); ++r) {
      // Wrong input is found here, before anything has run: sensors read their logs when made.
      RunSetup check =
          read_run(configuration_of(setup, setup.variants[v], setup.recordings[r]), plugins);
      if (v == 0 || r == 0) collect(check);
      for (int s = 0; s < setup.seeds; ++s) {
        const std::uint64_t seed = setup.seeds > 1 ? static_cast<std::uint64_t>(s) + 1 : check.seed;
        result.runs.push_back({v, r, seed, {}});
      }
    }
  }
  // Whether results can be written shows before the work, too.
  if (!folder.empty()) make_folder(folder);
  const auto begin = std::chrono::steady_clock::now();
  const int jobs = options.jobs > 0 ? options.jobs : tbb::this_task_arena::max_concurrency();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(jobs));
  Progress progress(setup.name, static_cast<int>(result.runs.size()));
  tbb::parallel_for(std::size_t{0}, result.runs.size(), [&](std::size_t i) {
    ExperimentRun& run = result.runs[i];
    try {
      const Node configuration =
          configuration_of(setup, setup.variants[run.variant], setup.recordings[run.recording]);
      RunSetup run_setup = read_run(configuration, plugins, run.seed);
      run.result = experiment::run(run_setup, collect(run_setup));
      if (options.keep_runs) {
        std::string name = run_setup.name;
        if (setup.seeds > 1) name += "_" + std::to_string(run.seed);
        write_run(folder / "runs" / name, run_setup, run.result);
      }
    } catch (const std::exception& error) {
      run.result.status = RunStatus::kFailed;
      run.result.cause = error.what();
    }
    progress.done(line_of(setup, run));
  });
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace viwo::experiment
