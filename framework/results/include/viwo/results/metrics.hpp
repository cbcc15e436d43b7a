// The numbers that a run is judged by. One that is declared in metrics.cpp stands in summary.json
// and on the page of a run, and in runs.csv, summary.json, tables and page of an experiment.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "viwo/run/run_result.hpp"

namespace viwo {

struct Metric {
  std::string key;                             ///< in files, with the SI unit
  std::string heading;                         ///< of a table, with its unit
  double table_scale;                          ///< from SI to the unit of the table
  std::function<double(const RunResult&)> of;  ///< NaN where a run has none
  double target = 0.;                          ///< best value; 0: the lower the better
};

/// Path lengths [m] that relative pose errors of a run were evaluated over.
std::set<double> segment_lengths_m(const RunResult& run);

/// Mean relative pose error over segments of a length, m or degrees; NaN if it was not evaluated.
double rpe(const RunResult& run, double length_m, bool degrees);

/// In the order of columns; relative pose errors over each of the lengths.
std::vector<Metric> metrics_over(const std::set<double>& lengths_m);

}  // namespace viwo
