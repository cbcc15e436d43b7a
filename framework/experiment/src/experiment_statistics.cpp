#include "experiment_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <utility>

#include "viwo/math/significant.hpp"
#include "viwo/run/calibration_track.hpp"

namespace viwo::experiment {

std::set<double> segment_lengths_m(const ExperimentResult& result) {
  std::set<double> lengths_m;
  for (const ExperimentRun& run : result.runs) {
    lengths_m.merge(viwo::segment_lengths_m(run.result));
  }
  return lengths_m;
}

std::vector<Metric> all_metrics(const ExperimentResult& result) {
  return metrics_over(segment_lengths_m(result));
}

std::vector<Metric> metrics_of(const ExperimentResult& result) {
  std::vector<Metric> metrics = all_metrics(result);
  std::erase_if(metrics, [&](const Metric& metric) {
    return std::none_of(result.runs.begin(), result.runs.end(), [&](const ExperimentRun& run) {
      return std::isfinite(metric.of(run.result));
    });
  });
  return metrics;
}

bool add_once(std::vector<std::string>& names, const std::string& name) {
  const bool is_new = std::find(names.begin(), names.end(), name) == names.end();
  if (is_new) names.push_back(name);
  return is_new;
}

std::vector<Group> groups_of(const ExperimentResult& result) {
  std::vector<Group> groups{{"", "all", [](const ExperimentRun&) { return true; }}};
  const auto& recordings = result.setup.recordings;
  for (const std::string& label : result.setup.report_by) {
    std::vector<std::string> seen;
    for (const Recording& recording : recordings) {
      const auto found = recording.labels.find(label);
      if (found == recording.labels.end()) continue;
      if (!add_once(seen, found->second)) continue;
      groups.push_back({label, found->second,
                        [&recordings, label, value = found->second](const ExperimentRun& run) {
                          const auto& labels = recordings[run.recording].labels;
                          const auto at = labels.find(label);
                          return at != labels.end() && at->second == value;
                        }});
    }
  }
  return groups;
}

/// What a run stopped at, when it failed or diverged, is no result: NaN.
static double value_of(const Metric& metric, const RunResult& run) {
  return run.status == RunStatus::kOk ? metric.of(run) : kNan;
}

std::vector<double> values_of(const ExperimentResult& result, std::size_t variant,
                              const Metric& metric, const Group& group) {
  std::vector<double> values;
  for (const ExperimentRun& run : result.runs) {
    if (run.variant != variant || !group.passes(run)) continue;
    const double value = value_of(metric, run.result);
    if (std::isfinite(value)) values.push_back(value);
  }
  return values;
}

RunCounts counts_of(const ExperimentResult& result, std::size_t variant, const Group& group) {
  RunCounts counts;
  for (const ExperimentRun& run : result.runs) {
    if (run.variant != variant || !group.passes(run)) continue;
    ++counts.runs;
    counts.diverged += run.result.status == RunStatus::kDiverged;
    counts.failed += run.result.status == RunStatus::kFailed;
    counts.doubtful += run.result.status == RunStatus::kOk && !is_trusted(run.result);
  }
  return counts;
}

std::vector<std::string> means_of_fewer(const ExperimentResult& result, const Group& group) {
  std::vector<std::string> all;
  const auto metrics = metrics_of(result);
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    const auto runs = static_cast<std::size_t>(counts_of(result, v, group).runs);
    std::map<std::size_t, std::vector<std::string>> headings;  // by how many runs have them
    for (const Metric& metric : metrics) {
      const std::size_t n = values_of(result, v, metric, group).size();
      if (n > 0) headings[n].push_back(metric.heading);
    }
    for (const auto& [n, of] : headings) {
      if (n == runs) continue;
      std::string text = result.setup.variants[v].name + ": ";
      for (const std::string& heading : of) text += (&heading == &of.front() ? "" : ", ") + heading;
      if (of.size() == metrics.size()) text = result.setup.variants[v].name + ": all means";
      all.push_back(text + " of " + std::to_string(n) + " of " + std::to_string(runs) + " runs");
    }
  }
  return all;
}

eval::PairedDifference paired(const ExperimentResult& result, std::size_t variant,
                              const Metric& metric, const Group& group) {
  std::vector<double> values, baseline;
  std::map<std::pair<std::size_t, std::uint64_t>, const ExperimentRun*> others;
  for (const ExperimentRun& run : result.runs) {
    if (run.variant == result.setup.baseline) others[{run.recording, run.seed}] = &run;
  }
  for (const ExperimentRun& run : result.runs) {
    if (run.variant != variant || !group.passes(run)) continue;
    const auto other = others.find({run.recording, run.seed});
    if (other == others.end()) continue;
    values.push_back(value_of(metric, run.result));
    baseline.push_back(value_of(metric, other->second->result));
  }
  return eval::paired_difference(values, baseline, kConfidence);
}

bool is_significant(const eval::PairedDifference& difference) {
  return difference.low > 0. || difference.high < 0.;
}

std::vector<std::string> estimated(const ExperimentResult& result,
                                   const std::function<bool(const ExperimentRun&)>& passes) {
  std::vector<std::string> names;
  for (const ExperimentRun& run : result.runs) {
    if (!passes(run)) continue;
    for (const CalibrationTrack& track : run.result.calibration) {
      if (is_estimated(run.result, track)) add_once(names, track.name);
    }
  }
  return names;
}

std::vector<CalibrationStatistics> calibration_statistics(const ExperimentResult& result,
                                                          std::size_t variant, const Group& group) {
  std::vector<CalibrationStatistics> all;
  std::vector<std::set<std::uint64_t>> seeds;  // of each
  for (const ExperimentRun& run : result.runs) {
    if (run.variant != variant || !group.passes(run)) continue;
    if (run.result.status != RunStatus::kOk) continue;
    for (const CalibrationTrack& track : run.result.calibration) {
      if (!is_estimated(run.result, track) || !std::isfinite(track.final_error)) continue;
      auto at =
          std::find_if(all.begin(), all.end(), [&](const auto& c) { return c.name == track.name; });
      if (at == all.end()) {
        at = all.insert(all.end(), {track.name});
        seeds.emplace_back();
      }
      seeds[static_cast<std::size_t>(at - all.begin())].insert(run.seed);
      const double e = track.final_error, sigma = track.sigma.back();
      const double normalised = e * e / (sigma * sigma);
      at->mean_error += e / sigma;
      ++at->runs;
      at->rmse += e * e;
      at->mean_sigma += sigma;
      at->prior_sigma += track.sigma.front();
      at->nees += normalised;
      at->widened_nees += normalised / (track.scatter * track.scatter);
    }
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    CalibrationStatistics& c = all[i];
    c.rmse = std::sqrt(c.rmse / c.runs);
    c.mean_sigma /= c.runs;
    c.prior_sigma /= c.runs;
    c.mean_error /= c.runs;
    c.nees /= c.runs;
    c.widened_nees /= c.runs;
    // A seed draws one robot for all motions.
    c.nees_bounds = eval::mean_nees_bounds(1, static_cast<int>(seeds[i].size()), kBoundsConfidence);
  }
  return all;
}

/// "r" of "r_2", "delta_o" of "delta_o3", "p_IinO" of "p_IinO_x".
static std::string family_of(std::string name) {
  const auto number = name.find_last_not_of("0123456789");
  if (number + 1 < name.size()) {
    name.resize(number + 1);
  } else if (name.ends_with("_x") || name.ends_with("_y") || name.ends_with("_z")) {
    name.resize(name.size() - 2);
  }
  while (name.ends_with('_')) name.pop_back();
  return name;
}

std::vector<CalibrationFamily> calibration_families(const ExperimentResult& result,
                                                    std::size_t variant, const Group& group) {
  std::vector<CalibrationFamily> families;
  std::vector<int> counts;
  for (const CalibrationStatistics& c : calibration_statistics(result, variant, group)) {
    const std::string name = family_of(c.name);
    std::size_t i = 0;
    while (i < families.size() && families[i].name != name) ++i;
    if (i == families.size()) {
      families.push_back({name});
      counts.push_back(0);
    }
    families[i].left += c.rmse * c.rmse / (c.prior_sigma * c.prior_sigma);
    families[i].nees += c.nees;
    families[i].widened_nees += c.widened_nees;
    families[i].is_consistent &= c.is_consistent();
    ++counts[i];
  }
  for (std::size_t i = 0; i < families.size(); ++i) {
    families[i].left = std::sqrt(families[i].left / counts[i]);
    families[i].nees /= counts[i];
    families[i].widened_nees /= counts[i];
  }
  return families;
}

std::string compact(double value, int digits) {
  const double size = std::abs(value);
  const bool whole = size >= std::pow(10., digits) && size < 1e6;
  return whole ? std::to_string(std::llround(value)) : significant(value, digits);
}

static std::string nees_text(double nees, double widened_nees, bool is_consistent) {
  return compact(nees, 2) + (is_consistent ? "" : "!") +
         (widened_nees < nees ? " / " + compact(widened_nees, 2) : "");
}

std::string nees_text(const CalibrationStatistics& of) {
  return nees_text(of.nees, of.widened_nees, of.is_consistent());
}

std::string nees_text(const CalibrationFamily& of) {
  return nees_text(of.nees, of.widened_nees, of.is_consistent);
}

RealtimeFactors realtime_factors(const ExperimentResult& result) {
  double duration_s = 0., wall_s = 0., new_duration_s = 0.;
  for (const ExperimentRun& run : result.runs) {
    duration_s += run.result.duration_s;
    wall_s += run.result.wall_s;
    if (!run.taken_over) new_duration_s += run.result.duration_s;
  }
  return {wall_s > 0. ? duration_s / wall_s : kNan,
          result.wall_s > 0. && new_duration_s > 0. ? new_duration_s / result.wall_s : kNan};
}

}  // namespace viwo::experiment
