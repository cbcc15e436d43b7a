// Batch calibration of the wheel intrinsics from encoder logs and a reference trajectory.
// Equations: docs/math/batch_calibration.md.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "viwo/run/run.hpp"
#include "viwo/run/work_progress.hpp"
#include "viwo/setup/configuration.hpp"

namespace viwo::calibration {

struct CalibrationOptions {
  double segment_s = 0.;             ///< length of the compared segments; 0: whole recordings
  bool parity = true;                ///< use the parity residual
  bool estimate_extrinsics = false;  ///< pose of O in the reference body; then the gauge is held
  double extrinsics_sigma_m = 0.01;
  double extrinsics_sigma_rad = 0.02;
  double clock_offset_sigma_s = 0.;  ///< prior of one offset per recording; 0: not estimated
};

/// Sizes of what a fit cannot explain: of the end pose of a segment, and of the parity residual
/// relative to what the model's sigmas predict.
struct CalibrationNoise {
  double position_m = 0.01;
  double yaw_rad = 0.01;
  double parity_scale = 1.;
};

/// A recording read into memory.
struct CalibrationRecording {
  Recording label;
  RunSetup setup;
  RunData data;
};

/// A calibration file, read, with its recordings.
struct CalibrationSetup {
  std::string name;
  CalibrationOptions options;
  std::vector<std::string> leave_out_by;  ///< labels whose values are left out in turn
  std::vector<std::string> report_by;     ///< labels to break the tables down by
  std::vector<CalibrationRecording> recordings;
};

/// A direction of the intrinsics, in units of the prior sigmas, about which the data say less than
/// the prior.
struct UndeterminedDirection {
  double sigma_ratio = 1.;  ///< posterior sigma over prior sigma along it
  std::vector<std::pair<std::string, double>> weights;  ///< largest first
};

/// What comes and goes of the intrinsics, in prior sigmas: a Gauss-Markov process.
struct WheelWander {
  double sigma = 0.;                              ///< 0: nothing was found
  double time_s = 0.;                             ///< time constant
  std::vector<double> lag_s, covariance, weight;  ///< what it was fitted to (CAL-6)
};

/// What one fit found.
struct CalibrationEstimate {
  Intrinsics x_WI;
  Intrinsics sigma;  ///< 0 where an entry was held
  PlanarExtrinsics extrinsics = PlanarExtrinsics::Zero();
  PlanarExtrinsics extrinsics_sigma = PlanarExtrinsics::Zero();
  std::vector<double> clock_offset_s;  ///< one per recording used
  CalibrationNoise noise;              ///< found in the data (CAL-5)
  int iterations = 0;
  bool converged = false;
  std::vector<UndeterminedDirection> undetermined;
};

/// A recording that a fit has not seen, with nominal and with calibrated intrinsics.
struct ValidationRun {
  std::size_t recording = 0;
  RunResult nominal;
  RunResult calibrated;
};

/// All recordings, each with the estimate from those that have another value of a label.
struct LeftOut {
  std::string by;     ///< the label
  Intrinsics spread;  ///< of the estimate from all, by how those without one value differ (CAL-8)
  std::vector<ValidationRun> runs;
};

struct CalibrationResult {
  const CalibrationSetup* setup = nullptr;
  CalibrationEstimate all;        ///< from all recordings; its sigmas are not below any `spread`
  Intrinsics sigma_of_fit;        ///< those that the fit itself believes
  std::vector<LeftOut> left_out;  ///< of each of leave_out_by
  WheelWander wander;             ///< at the estimate from all
  std::vector<ValidationRun> fitted;  ///< all recordings with the estimate from all of them
};

/// Throws InputError for what is wrong in the configuration or in a recording.
CalibrationSetup read_calibration_setup(const std::filesystem::path& file,
                                        const std::vector<std::string>& assignments,
                                        PluginRegistry& plugins);

/// Fits the recordings named by index (CAL-1). Throws std::runtime_error when the solver fails.
CalibrationEstimate fit(const CalibrationSetup& setup, const std::vector<std::size_t>& recordings);

/// All of the data, and without what is left out in turn. Throws InputError where nothing is left
/// to fit.
CalibrationResult calibrate(const CalibrationSetup& setup, WorkProgress& progress = no_progress());

/// Writes calibration.yaml, summary.json and report.html.
void write_calibration(const std::filesystem::path& folder, const CalibrationResult& result);

/// Tables for the terminal.
std::string describe(const CalibrationResult& result);

}  // namespace viwo::calibration
