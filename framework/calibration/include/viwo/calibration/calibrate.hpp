// Batch calibration of the wheel intrinsics from encoder logs and what is known of the motion: a
// reference trajectory, a gyro, a ruler.
// Equations: docs/math/batch_calibration.md.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "viwo/plugin_host/registry.hpp"
#include "viwo/run/run.hpp"
#include "viwo/run/work_progress.hpp"
#include "viwo/setup/configuration.hpp"
#include "viwo/smoother/smoother.hpp"

namespace viwo::calibration {

/// What the motion of the wheels is compared with.
enum class ReferenceKind {
  kAuto,      ///< poses where there are any, else the gyro
  kPoses,     ///< relative poses of the reference body
  kGyro,      ///< the turn by the gyro, about the mean direction of what the accelerometer feels
  kNone,      ///< nothing: the wheels among themselves, and what was measured by hand
  kSmoother,  ///< no reference: all that the filter of the base takes, smoothed (viwo/smoother)
};

/// What is compared with the reference (docs/math/batch_calibration.md).
enum class Segments {
  kAuto,        ///< of the length whose estimate is the surest (CAL-11)
  kWhole,       ///< whole recordings
  kLength,      ///< of segment_s
  kPoses,       ///< from each pose of the reference to the next
  kTrajectory,  ///< from the start to every segment_s
};

struct CalibrationOptions {
  ReferenceKind reference = ReferenceKind::kAuto;
  Segments segments = Segments::kAuto;
  double segment_s = 0.;
  bool parity = true;                ///< use the parity residual
  bool find_steering_zeros = false;  ///< anywhere on the circle (CAL-12)
  bool find_drive_signs = false;
  bool estimate_extrinsics = false;  ///< pose of O in the reference body; then the gauge is held
  Eigen::Vector3d extrinsics_x_m_y_m_yaw_rad{0., 0., 0.};
  double prior_sigma_extrinsics_m = 0.01;
  double prior_sigma_extrinsics_rad = 0.02;
  double prior_sigma_clock_offset_s = 0.01;  ///< of one offset per recording; 0: not estimated
  double prior_sigma_gyro_bias_rad_per_s = 0.02;
  double sigma_distance_m = 0.005;
  double sigma_turn_deg = 0.5;

  void bind(ParamBinder& b);
};

/// Sizes of what a fit cannot explain: of the end pose of a segment, and of the parity residual
/// relative to what the model's sigmas predict.
struct CalibrationNoise {
  double position_m = 0.01;
  double yaw_rad = 0.01;
  double parity_scale = 1.;
  /// Whether there was enough to find it in.
  bool position_is_found = false, yaw_is_found = false;
};

/// What the wheels of a recording are compared with.
struct MotionReference {
  ReferenceKind kind = ReferenceKind::kNone;  ///< kPoses, kGyro or kNone
  Trajectory poses;                           ///< of B; of the gyro the yaw alone, positions zero
  double offset_s = 0.;              ///< stamp of the reference = stamp of the wheels + offset
  double max_gap_s = 0.5;            ///< not interpolated over more
  std::optional<double> distance_m;  ///< how far O was driven, along its path, by hand
  std::optional<double> turn_rad;    ///< by how much it has turned from start to end, by hand
};

/// A recording read into memory.
struct CalibrationRecording {
  Recording label;
  RunSetup setup;
  RunData data;
  MotionReference motion;
  config::Node run = {};  ///< of the filter, for a smoother
};

/// A calibration file, read, with its recordings.
struct CalibrationSetup {
  std::string name;
  PluginRegistry* plugins = nullptr;  ///< that the runs were read with
  CalibrationOptions options;
  std::vector<std::string> leave_out_by;  ///< labels whose values are left out in turn
  bool leave_out_is_asked = true;         ///< false: they are the usual ones
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
  std::vector<double> variance;                   ///< of each covariance where nothing wanders
};

/// A measurement by hand, and what the fit leaves of it.
struct ByHand {
  std::size_t recording = 0;  ///< of the setup
  std::string label;          ///< "distance_m", "turn_deg"
  double sigmas = 0.;         ///< by which the wheels miss it
};

/// How the turns of the wheels in the segments go with those of the reference.
struct TurnAgreement {
  int segments = 0;
  double wheels_rad2 = 0., reference_rad2 = 0., product_rad2 = 0.;  ///< sums over the segments

  void add(double wheels_rad, double reference_rad);
  /// Correlation about zero, -1 .. 1; 0 where nothing turns.
  double correlation() const;
  /// By how many sigmas that is more than chance.
  double sigmas() const;
  /// How many times as much the reference turns.
  double ratio() const;
};

/// What one fit found.
struct CalibrationEstimate {
  Intrinsics x_WI;
  Intrinsics sigma;  ///< 0 where an entry was held
  /// Before the data, in the frame of x_WI: where the gauge holds entries, what they may be off by
  /// is in the others (CAL-18).
  Intrinsics prior_sigma;
  /// By how many of these x_WI is from `nominal`, its value before; 0 where it was held.
  double change(Eigen::Index k, double nominal) const {
    return prior_sigma[k] > 0. ? (x_WI[k] - nominal) / prior_sigma[k] : 0.;
  }
  PlanarExtrinsics extrinsics = PlanarExtrinsics::Zero();
  PlanarExtrinsics extrinsics_sigma = PlanarExtrinsics::Zero();
  Eigen::MatrixXd correlations;  ///< of x_WI
  // One per recording used; sigma 0 where it was not estimated.
  std::vector<double> clock_offset_s, clock_offset_sigma_s;
  std::vector<double> gyro_bias_rad_per_s, gyro_bias_sigma_rad_per_s;
  CalibrationNoise noise;  ///< found in the data (CAL-5)
  Segments segments = Segments::kWhole;
  double segment_s = 0.;  ///< 0: whole recordings
  int residuals = 0;      ///< of turns, positions and what was measured by hand
  std::vector<ByHand> by_hand;
  int weighed_down = 0;       ///< segments that fit no normal noise (CAL-15)
  int with_holes = 0;         ///< segments that are not compared, for holes of wheels or gyro
  int unknowns = 0;           ///< that were estimated, those of the recordings with them
  int parity_directions = 0;  ///< about which the wheels alone tell more than the prior
  double turn_rms_rad = 0., way_rms_m = 0.;  ///< of the segments, by the reference
  TurnAgreement turns;
  double cost = 0.;
  double log_volume = 0.;  ///< of the intrinsics' covariance in prior units, square root (CAL-11)
  /// By how much dead reckoning misses the ends of recordings that are left out, where it was
  /// tried.
  std::optional<double> prediction_m;
  int iterations = 0;
  bool converged = false;
  std::vector<UndeterminedDirection> undetermined;

  /// Unknowns that the parity does not tell.
  int to_be_told() const { return unknowns - parity_directions; }
  /// Twice as many as those.
  bool has_enough_residuals() const { return residuals >= 2 * to_be_told(); }
};

/// Where a fit begins, and what is known of it: centre and sigmas of the prior.
struct FitStart {
  Intrinsics x_WI, sigma;
};

/// What was searched for and found (CAL-12).
struct JointSearch {
  std::vector<int> zeros;  ///< intrinsics that are zeros of the steering; empty: none searched
  std::vector<int> drive_signs;  ///< -1 for a drive that turns backwards
  Intrinsics x_WI;               ///< of the best solution
  double cost = 0.;
  Intrinsics other;                    ///< of the best that is another one
  std::vector<int> other_drive_signs;  ///< likewise
  double other_cost = 0.;              ///< infinite where there is none
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
  std::vector<std::string> failed;  ///< values without which nothing could be fitted, and why
};

struct CalibrationResult {
  const CalibrationSetup* setup = nullptr;
  JointSearch search;
  /// What the smoother found, of cameras, mount and clocks, too.
  std::optional<smoother::Smoothed> smoothed;
  std::vector<CalibrationEstimate> lengths;  ///< with segments of several lengths, if one is chosen
  std::vector<std::string> failed_lengths;   ///< those that could not be fitted, and why
  /// From all recordings; its sigmas are not below any `spread` that was asked for.
  CalibrationEstimate all;
  Intrinsics sigma_of_fit;            ///< those that the fit itself believes
  std::vector<LeftOut> left_out;      ///< of each of leave_out_by
  WheelWander wander;                 ///< at the estimate from all
  std::vector<ValidationRun> fitted;  ///< all recordings with the estimate from all of them
  std::vector<std::string> doubts;    ///< why it is not to be trusted
  std::vector<std::string> warnings;  ///< what its reader should know

  bool is_trusted() const { return doubts.empty(); }
};

/// The keys of a calibration file, but for recordings, motions and set.
std::vector<ParamSpec> calibration_params();

/// Throws InputError for what is wrong in the configuration or in a recording.
CalibrationSetup read_calibration_setup(const std::filesystem::path& file,
                                        const std::vector<std::string>& assignments,
                                        PluginRegistry& plugins);

/// Nominal values and their sigmas; zeros where they have been found, to be refined.
FitStart start_of(const CalibrationSetup& setup, const JointSearch& search);

/// All recordings by index.
std::vector<std::size_t> all_of(const CalibrationSetup& setup);

/// Of a fit: the recordings have no solution.
struct NoSolution : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Fits the recordings named by index (CAL-1); the segments of `options` are not kAuto. Throws
/// NoSolution when the solver fails.
CalibrationEstimate fit(const CalibrationSetup& setup, const std::vector<std::size_t>& recordings,
                        const CalibrationOptions& options, const FitStart& start);

/// The wheels of a recording alone, with an estimate.
RunResult dead_reckon(const CalibrationRecording& recording, const CalibrationEstimate& estimate);

/// "2 s", "whole recordings", ...
std::string segments_text(const CalibrationEstimate& estimate);

/// All of the data, and without what is left out in turn. Drives that turn backwards are put right
/// in `setup`. Throws InputError where nothing is left to fit.
CalibrationResult calibrate(CalibrationSetup& setup, WorkProgress& progress = no_progress());

}  // namespace viwo::calibration
