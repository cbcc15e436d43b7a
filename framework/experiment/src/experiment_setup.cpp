// What an experiment's file says.
#include <algorithm>
#include <cstdint>
#include <string_view>

#include "viwo/config/file_kind.hpp"
#include "viwo/config/overrides.hpp"
#include "viwo/config/params.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/experiment/experiment.hpp"
#include "viwo/setup/configuration.hpp"

namespace viwo::experiment {
namespace {

using config::Node;

struct ExperimentParams {
  std::string experiment;
  std::string base;
  int seeds = 1;
  std::vector<std::string> report_by;
  std::string baseline;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(experiment), {.required = true, .help = "name of the experiment"});
    b(VIWO_PARAM(base), {.required = true, .help = "run configuration, relative to this file"});
    b(VIWO_PARAM(seeds),
      {.min = 1., .help = "runs of each variant and recording, with seeds 1, 2, ..."});
    b(VIWO_PARAM(report_by), {.help = "labels of the recordings to break the tables down by"});
    b(VIWO_PARAM(baseline),
      {.help = "variant that the others are compared with; the first if not given"});
  }
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

void find_baseline(const Node& file, const std::string& name, ExperimentSetup& setup) {
  if (name.empty()) return;
  std::vector<std::string> names;
  for (const Variant& variant : setup.variants) names.push_back(variant.name);
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    config::fail(file.find("baseline")->mark(), "baseline: there is no variant '" + name + "'" +
                                                    config::did_you_mean(name, names));
  }
  setup.baseline = static_cast<std::size_t>(found - names.begin());
}

/// Each takes a place in memory and in the journal, and is checked before the first one begins.
constexpr std::uint64_t kMostRuns = 100'000;

/// `seeds`: where their number stands.
void require_possible(const ExperimentSetup& setup, const config::Mark& seeds) {
  const std::uint64_t variants = setup.variants.size(), recordings = setup.recordings.size();
  const std::uint64_t cells = variants * recordings;  // both are limited by the size of the file
  const auto runs = cells * static_cast<std::uint64_t>(setup.seeds);
  if (runs <= kMostRuns) return;
  config::fail(seeds, std::to_string(variants) + " variants x " + std::to_string(recordings) +
                          " recordings x " + std::to_string(setup.seeds) + " seeds are " +
                          std::to_string(runs) + " runs, an experiment has up to " +
                          std::to_string(kMostRuns) + " - make several of it");
}

}  // namespace

Node configuration_of(const ExperimentSetup& setup, const Variant& variant,
                      const Recording& recording) {
  Node run = setup.base;
  config::merge(run, variant.overrides);
  Node resolved = resolve_placeholders(run, recording.labels);
  resolved.set(
      "name", Node::scalar_of(variant.name + (recording.name.empty() ? "" : "_" + recording.name)));
  return resolved;
}

ExperimentSetup read_experiment(const std::filesystem::path& path,
                                const ExperimentOptions& options) {
  const Node file = config::load_file(path);
  config::require_file_of("experiment", file);
  config::Errors errors;
  constexpr std::string_view kSections[] = {"variants", "recordings", "motions", "set"};
  const auto params =
      config::read_section<ExperimentParams>(file, file.mark(), "experiment", errors, kSections);
  errors.throw_if_any();
  ExperimentSetup setup;
  setup.name = params.experiment;
  setup.seeds = options.seeds.value_or(params.seeds);
  if (setup.seeds < 1) throw InputError("--seeds must be at least 1");
  setup.report_by = params.report_by;
  setup.base_file = params.base;
  setup.recordings = read_recordings(file);
  setup.base = load_base(file, options.assignments);
  require_labels(setup.report_by, setup.recordings, file, "report_by");
  read_variants(file, setup);
  find_baseline(file, params.baseline, setup);
  const Node* const seeds = file.find("seeds");
  require_possible(setup, options.seeds      ? config::Mark{"--seeds"}
                          : seeds != nullptr ? seeds->mark()
                                             : file.mark());
  return setup;
}

}  // namespace viwo::experiment
