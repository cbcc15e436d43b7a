// The numbers that an experiment is judged by, over groups of its runs.
#pragma once

#include <functional>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "viwo/eval/consistency.hpp"
#include "viwo/eval/statistics.hpp"
#include "viwo/experiment/experiment.hpp"
#include "viwo/results/metrics.hpp"

namespace viwo::experiment {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kConfidence = 0.95;        ///< of the intervals of paired differences
inline constexpr double kBoundsConfidence = 0.99;  ///< of the bounds of a parameter's NEES

/// Path lengths [m] that relative pose errors of any run were evaluated over.
std::set<double> segment_lengths_m(const ExperimentResult& result);

/// In the order of the columns; relative pose errors over every length of any run.
std::vector<Metric> all_metrics(const ExperimentResult& result);

/// Those that at least one run has.
std::vector<Metric> metrics_of(const ExperimentResult& result);

/// Appends `name` unless it is there already; whether it has.
bool add_once(std::vector<std::string>& names, const std::string& name);

/// Some of the runs, with a name. Must not outlive the result that it is of.
struct Group {
  std::string label;  ///< one of report_by; empty: all runs
  std::string value;  ///< of the label
  std::function<bool(const ExperimentRun&)> passes;
};

/// All runs, then one group per value of each label in report_by, in order of appearance.
std::vector<Group> groups_of(const ExperimentResult& result);

/// Finite values of a metric over the runs of a variant in a group.
std::vector<double> values_of(const ExperimentResult& result, std::size_t variant,
                              const Metric& metric, const Group& group);

struct RunCounts {
  int runs = 0, diverged = 0, failed = 0, doubtful = 0;
  int not_ok() const { return diverged + failed; }
};
RunCounts counts_of(const ExperimentResult& result, std::size_t variant, const Group& group);

/// Which means are of fewer runs than there are: "drive_only: ATE of 3 of 5 runs".
std::vector<std::string> means_of_fewer(const ExperimentResult& result, const Group& group);

/// Variant minus baseline over the pairs of runs with the same recording and seed.
eval::PairedDifference paired(const ExperimentResult& result, std::size_t variant,
                              const Metric& metric, const Group& group);

/// Whether the interval does not reach zero.
bool is_significant(const eval::PairedDifference& difference);

/// Final errors of one calibration parameter over the runs of a variant that estimated it.
struct CalibrationStatistics {
  std::string name;
  int runs = 0;
  double rmse = 0., mean_sigma = 0., prior_sigma = 0.;
  double mean_error = 0.;          ///< mean normalised error: of a biased estimate not zero
  double nees = 0.;                ///< mean squared normalised error
  double widened_nees = 0.;        ///< likewise, by sigmas times their scatter (F-42)
  eval::NeesBounds nees_bounds{};  ///< of a consistent one in kBoundsConfidence of all experiments
  bool is_consistent() const { return nees >= nees_bounds.low && nees <= nees_bounds.high; }
};
std::vector<CalibrationStatistics> calibration_statistics(const ExperimentResult& result,
                                                          std::size_t variant, const Group& group);

/// Parameters of one kind, "r" for r_1, r_2, ..., together.
struct CalibrationFamily {
  std::string name;
  double left = 0.;                     ///< root mean square of rmse / prior sigma
  double nees = 0., widened_nees = 0.;  ///< means
  bool is_consistent = true;            ///< each of its parameters
};
std::vector<CalibrationFamily> calibration_families(const ExperimentResult& result,
                                                    std::size_t variant, const Group& group);

/// A number for a table: `digits` significant digits, and whole from there up to a million.
std::string compact(double value, int digits);

/// What nees_text() says, for captions.
inline constexpr const char* kNees =
    "NEES, 1 is consistent, ! is outside of the bounds of 99 %; behind a slash that of "
    "sigmas times their scatter";

/// "2.4"; "54! / 2.3" where it is not consistent, and sigmas that are widened by their scatter make
/// it smaller.
std::string nees_text(const CalibrationStatistics& of);
std::string nees_text(const CalibrationFamily& of);

/// Names of the parameters that some of the runs estimated, in order of appearance.
std::vector<std::string> estimated(const ExperimentResult& result,
                                   const std::function<bool(const ExperimentRun&)>& passes);

/// How many seconds of the robot's time pass in one second.
struct RealtimeFactors {
  double core = 0.;     ///< of the computing of one core, without reading or simulating
  double overall = 0.;  ///< on the clock, all jobs together, without runs that were taken over
};
RealtimeFactors realtime_factors(const ExperimentResult& result);

}  // namespace viwo::experiment
