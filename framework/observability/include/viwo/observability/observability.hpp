// What a base, its updates and a motion can tell of the state: the observability matrix of a run
// without noise, from the estimator's own Jacobians. Theory: docs/observability.md.
#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/experiment/experiment.hpp"
#include "viwo/run/work_progress.hpp"

namespace viwo::observability {

using experiment::ExperimentOptions;
using experiment::ExperimentSetup;

/// A set of directions that theory names, as it lies to the null space.
struct ExplainedDirections {
  std::string name;
  std::string when;   ///< theory says that they are hidden
  int dimension = 0;  ///< of the set
  int hidden = 0;     ///< of these, how many are unobservable
  int adds = 0;       ///< of these, how many the sets before do not explain already
  /// Largest principal angle between the set and the null space, rad; tiny: all of it is hidden.
  double max_angle_rad = 0.;
};

/// Rank and null space of one state.
struct Observability {
  std::vector<std::string> states;  ///< names; the clone of the start is not among them
  int state_size = 0;               ///< with the clone
  int rank = 0;                     ///< likewise
  int unobservable = 0;
  double gap = 0.;  ///< smallest singular value kept over the largest one dropped
  Eigen::VectorXd singular_values;
  Eigen::MatrixXd null_basis;  ///< readable, in units of the prior sigmas
  // Only of a state whose gauge is free: with it held, what theory names comes mixed with the
  // gauge.
  std::vector<ExplainedDirections> explained;
  int unexplained = 0;  ///< null directions that are in none of the sets
};

/// What becomes of one calibration parameter.
struct ObservedParameter {
  std::string name;
  bool observable = false;
  double sigma_ratio = 1.;  ///< of the estimator after the motion to its prior
};

/// Sigma of the calibration over time, in units of the prior sigmas: along the directions that are
/// hidden (NaN: there are none), and along those orthogonal to them.
struct SigmaOverTime {
  std::vector<double> t_s;
  std::vector<double> hidden;
  std::vector<double> others;
};

/// One motion with one variant.
struct ObservabilityResult {
  std::size_t variant = 0;
  std::size_t motion = 0;
  Observability held;  ///< the state as configured, gauge entries held
  Observability free;  ///< with the gauge entries free
  std::vector<ObservedParameter> parameters;
  /// Wheels alone, poses known: null space of the intrinsics (all of them, gauge free), and with
  /// the planar mount (theta_ItoO_z, p_IinO_x, p_IinO_y) unknown, too. -1: no wheels.
  int wheels_alone = -1, wheels_and_mount = -1;
  int n_intrinsics = 0;
  int hidden_calibration = 0;   ///< dimension of what is hidden of the calibration as configured
  SigmaOverTime without_noise;  ///< of the frozen estimator
  SigmaOverTime as_configured;  ///< of the run with its noise and its wrong start
};

struct ObservabilityReport {
  ExperimentSetup setup;
  std::vector<ObservabilityResult> results;  ///< by motion, then variant
  double tolerance = 0.;
  double wall_s = 0.;
  std::vector<std::string> notes;  ///< what the reader must know about the input
};

/// Reads an experiment file (variants x motions), or a run configuration (one of each). Throws
/// InputError.
ExperimentSetup read_observability(const std::filesystem::path& file,
                                   const ExperimentOptions& options);

/// Noise and wrong starts are switched off where sensors and estimator have such parameters; the
/// estimate is frozen at the truth. Throws InputError for a run without filter or without true
/// states.
ObservabilityReport analyse(const ExperimentSetup& setup, PluginRegistry& plugins,
                            WorkProgress& progress = no_progress(), double tolerance = 5e-5);

/// Writes observability.json and report.html.
void write_observability(const std::filesystem::path& folder, const ObservabilityReport& report);
report::Document report_of(const ObservabilityReport& report);

/// The table for the terminal.
std::string describe(const ObservabilityReport& report);

}  // namespace viwo::observability
