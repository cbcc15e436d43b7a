// Whole runs of configs/experiments/plane_and_gnss.yaml for the tests of the two updates in it, and
// the honesty of their covariance at single instants over the seeds (tests/filter).
#pragma once

#include <algorithm>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "registry.hpp"
#include "viwo/eval/consistency.hpp"
#include "viwo/experiment/experiment.hpp"
#include "viwo/run/run.hpp"

namespace viwo::testing {

inline std::vector<RunResult> plane_and_gnss(const std::string& variant, int seeds,
                                             std::vector<std::string> assignments) {
  experiment::ExperimentOptions options;
  options.seeds = seeds;
  options.assignments = std::move(assignments);
  auto setup = experiment::read_experiment(
      std::string(VIWO_TEST_SOURCE_DIR) + "/configs/experiments/plane_and_gnss.yaml", options);
  std::erase_if(setup.variants, [&](const auto& v) { return v.name != variant; });
  auto result = experiment::run_experiment(setup, options, registry(), {});
  std::vector<RunResult> runs;
  for (experiment::ExperimentRun& run : result.runs) runs.push_back(std::move(run.result));
  return runs;
}

/// Empty when the mean NEES of the pose over the runs is within its two-sided 99.9 % bounds at all
/// of four instants, else what is not.
inline std::string inconsistency(const std::vector<RunResult>& runs) {
  const std::vector<double> instants{5., 15., 25., 29.5};
  std::ostringstream out;
  const int n = static_cast<int>(runs.size());
  const auto bounds = eval::mean_nees_bounds(6, n, 1. - 0.001 / 4.);
  for (const double instant : instants) {
    double mean = 0.;
    for (const auto& run : runs) {
      const auto at = std::find_if(run.nees.series.begin(), run.nees.series.end(),
                                   [&](const auto& entry) { return entry.first >= instant; });
      if (at == run.nees.series.end()) return "a run ended early: " + run.cause;
      mean += at->second / n;
    }
    if (mean > bounds.low && mean < bounds.high) continue;
    out << "at " << instant << " s: mean NEES " << mean << " outside of " << bounds.low << " .. "
        << bounds.high << "\n";
  }
  return out.str();
}

/// Mean of squared final error / variance of a calibration parameter.
inline double parameter_nees(const std::vector<RunResult>& runs, const std::string& name) {
  double sum = 0.;
  for (const auto& run : runs) {
    for (const auto& track : run.calibration) {
      if (track.name != name) continue;
      const double ratio = track.final_error / track.sigma.back();
      sum += ratio * ratio / static_cast<double>(runs.size());
    }
  }
  return sum;
}

/// Counts of an update over all runs.
inline UpdateCounts counts(const std::vector<RunResult>& runs, const std::string& update) {
  UpdateCounts sum;
  for (const auto& run : runs) {
    for (const auto& track : run.updates) {
      if (track.name != update) continue;
      sum.applied += track.total.applied;
      sum.rejected += track.total.rejected;
    }
  }
  return sum;
}

}  // namespace viwo::testing
