// What a run leaves: trajectory, accuracy, calibration, what became of its measurements.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "viwo/calibration_file/calibration_file.hpp"
#include "viwo/estimator/estimator.hpp"
#include "viwo/eval/accuracy.hpp"
#include "viwo/feed/stage_time.hpp"
#include "viwo/math/trajectory.hpp"
#include "viwo/wheel/preintegration.hpp"

namespace viwo {

enum class RunStatus { kOk, kDiverged, kFailed };
const char* name(RunStatus status);

/// One calibration parameter over a run.
struct CalibrationTrack {
  std::string name;
  std::string unit;              ///< "m", "rad", ...; "" for none
  std::vector<double> estimate;  ///< at RunResult::epoch_t_s
  std::vector<double> sigma;
  /// In the gauge that the estimate holds; NaN: not known.
  double truth = std::numeric_limits<double>::quiet_NaN();
  /// Last estimate minus truth in the filter's own error convention; NaN without truth.
  double final_error = std::numeric_limits<double>::quiet_NaN();
  /// By how many times its sigma it moves as it is learned (F-42); 1: that may be chance.
  double scatter = 1.;
};

/// What the filter itself says of the pose that it ends with, in the frame that it started in; NaN
/// without a filter.
struct EndSigma {
  double position_m = std::numeric_limits<double>::quiet_NaN();  ///< root of the trace
  double yaw_rad = std::numeric_limits<double>::quiet_NaN();
  double grown_m = 0.;  ///< of the position, since the start
};

/// Mean over the epochs of the squared normalised error, in the filter's own error convention.
struct PoseNees {
  double pose = std::numeric_limits<double>::quiet_NaN();         ///< 6 = consistent
  double position = std::numeric_limits<double>::quiet_NaN();     ///< 3
  double orientation = std::numeric_limits<double>::quiet_NaN();  ///< 3
  /// Of the pose as seen from the oldest clone: what the start has to do with it is gone. 6.
  double relative = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::pair<double, double>> series;  ///< time [s], pose
};

/// Error of the filter's estimate at an epoch, with its own sigmas.
struct PoseError {
  double t_s = 0.;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< estimate - truth, in G
  Eigen::Vector3d position_sigma_m = Eigen::Vector3d::Zero();
  double yaw_rad = 0.;  ///< estimate - truth, about the vertical
  double yaw_sigma_rad = 0.;
};

/// What became of the factors of one update.
struct UpdateTrack {
  std::string name;
  UpdateCounts total;
  std::vector<int> applied;   ///< in each epoch, at RunResult::epoch_t_s
  std::vector<int> rejected;  ///< likewise: by a gate, or not finite
  UpdateFailures failures{};
};

/// Something that the estimator has to tell its user while it runs.
struct MonitorWarning {
  double t_s = 0.;
  std::string text;                     ///< "no yaw rate for 5 s: ... - turn"
  std::vector<std::string> parameters;  ///< which of the calibration it concerns
};

/// What the recent motion told about the calibration, now and then.
struct MonitorTrack {
  std::vector<double> t_s;
  std::vector<std::string> parameters;
  /// For each parameter over time: the sigma that the window alone would leave of the prior sigma,
  /// 1: nothing was learned.
  std::vector<std::vector<double>> sigma_ratio;
  std::vector<int> held;  ///< over time: how many directions are held
  std::vector<MonitorWarning> warnings;
};

/// A picture of a run at one instant (pictures.hpp).
struct RunPicture {
  double t_s = 0.;
  std::string png;  ///< the bytes of the file
};

/// What the filter estimated without starting anew.
struct RunPiece {
  std::int64_t begin_ns = 0, end_ns = 0;  ///< stamps of the first and the last epoch
  std::int64_t epochs = 0;
  std::string failure;  ///< why it ended; "" for one that came to the end of the run
};

struct RunResult {
  RunStatus status = RunStatus::kOk;
  std::string cause;  ///< of a run that is not ok
  std::int64_t epochs = 0;
  double duration_s = 0.;
  double wall_s = 0.;    ///< of the odometry, without reading
  bool live = false;     ///< from sensors that gave what happened just then
  Trajectory estimate;   ///< of the reference body B
  Trajectory reference;  ///< planar
  std::optional<eval::Accuracy> accuracy;
  double nees_planar =
      std::numeric_limits<double>::quiet_NaN();  ///< mean over epochs, 3 = consistent
  /// From the first to the last epoch, without the parity information; of a run of the filter
  /// samples and path alone, by the wheels as configured.
  PreintegratedPose total;
  std::vector<std::pair<double, double>> epoch_ms;        ///< time since start [s], time spent [ms]
  std::vector<std::pair<std::string, StageTime>> stages;  ///< without the total
  StageTime total_ms;                                     ///< of an epoch
  std::vector<std::pair<std::string, RejectionCount>> rejections;
  std::vector<NoiseFound> noises;     ///< "UPDATE.NAME", by updates that look for them
  std::vector<std::string> warnings;  ///< what is suspicious of the run as a whole
  /// Why a run that came to its end is not to be trusted (warnings.hpp).
  std::vector<std::string> doubts;

  // Of the filter.
  PoseNees nees;
  EndSigma end_sigma;
  std::vector<PoseError> errors;  ///< where the reference is in the frame of the estimate
  std::vector<double> epoch_t_s;
  std::vector<CalibrationTrack> calibration;
  std::optional<CalibrationFile> final_calibration;  ///< of wheels and cameras
  std::vector<UpdateTrack> updates;
  MonitorTrack monitor;
  /// More than one: it diverged and was started again. Those without an epoch are not here.
  std::vector<RunPiece> pieces;
  /// Whether a RunStream has written trajectory, calibration and times; here they are thinned.
  bool on_disk = false;
  std::vector<RunPicture> pictures;  ///< for the page, in time order
};

/// That of the result as a whole: of a run that came to its end with doubts "doubtful".
const char* status_text(const RunResult& result);
/// Why that is not "ok": the cause, or the first of the doubts; "" of a result that is trusted.
std::string reason(const RunResult& result);
inline bool is_trusted(const RunResult& result) {
  return result.status == RunStatus::kOk && result.doubts.empty();
}

}  // namespace viwo
