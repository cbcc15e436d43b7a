// One run: sensors in, wheel odometry or the filter through it, trajectory and its accuracy out.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viwo/config/node.hpp"
#include "viwo/eval/accuracy.hpp"
#include "viwo/experiment/filter_setup.hpp"
#include "viwo/experiment/recorded.hpp"
#include "viwo/experiment/routes.hpp"
#include "viwo/math/trajectory.hpp"
#include "viwo/plugin_host/registry.hpp"
#include "viwo/wheel/preintegration.hpp"

namespace viwo::experiment {

/// Where the reference body B is on the base: pose [x_m, y_m, yaw_rad] of O in B.
using PlanarExtrinsics = Eigen::Vector3d;

/// A sensor of a run. Its `input`, if it takes one, is a sensor before it.
struct SensorEntry {
  std::string name;
  Loaded<Sensor> sensor;
  std::string input;  ///< name of the sensor whose measurements it is given; "" for none
};

/// A run configuration that has been read and checked, its plugins loaded and its model ready.
struct RunSetup {
  std::string name;
  std::uint64_t seed = 1;
  Loaded<KinematicModel> kinematics;        ///< without object in a run without wheels
  std::shared_ptr<const WheelModel> model;  ///< likewise null
  Intrinsics x_WI;                          ///< to run with: nominal, or from a calibration file
  Intrinsics sigma;  ///< how well they are known; 0 where the gauge holds an entry
  PlanarExtrinsics extrinsics = PlanarExtrinsics::Zero();
  std::optional<PlanarExtrinsics> O_in_I;  ///< of the section `wheels`: where states are reference
  std::vector<SensorEntry> sensors;        ///< those that take an input behind their input
  PreintegrationOptions preintegration;
  double epoch_s = 0.1;
  double reference_time_offset_s = 0.;  ///< t_reference = t_wheel + offset
  double reference_max_gap_s = 0.5;
  eval::Options evaluation;
  std::optional<FilterSetup> filter;           ///< nothing: dead reckoning from the wheels alone
  Routes routes;                               ///< who gets what the sensors give
  config::Mark kinematics_mark, sensors_mark;  ///< where the sections are written
  config::Node resolved;              ///< all of it, with defaults: a valid run configuration
  std::vector<std::string> warnings;  ///< what is suspicious in it, for those of the result
};

/// Reads a run configuration without placeholders. `seed` overrules the configured one; `exact`:
/// without noise and wrong starts (HostServices::exact). Throws InputError with everything that is
/// wrong in it.
RunSetup read_run(const config::Node& run, PluginRegistry& plugins,
                  std::optional<std::uint64_t> seed = {}, bool exact = false);

/// A sensor that is read while the filter runs: what turns images into tracks.
struct SensorStream {
  std::string name;
  PluginInfo info;
  std::shared_ptr<Sensor> sensor;
  std::string input_name;
  std::shared_ptr<Sensor> input;  ///< what it reads from; null where that is a live sensor
};

/// What the sensors of a run gave, as far as somebody wants it.
struct RunData {
  Recorded recorded;
  std::string wheels_name;                    ///< sensor that gave the encoder samples
  Trajectory reference;                       ///< planar; empty if there is none
  std::vector<SensorStream> streams;          ///< not read yet
  std::vector<SensorStream> live;             ///< measurements that are still to happen
  std::map<std::string, double> calibration;  ///< true values, if known
  std::vector<std::pair<std::string, RejectionCount>> rejections;  ///< by sensor

  std::span<const ImuSample> imu() const { return recorded.of<ImuSample>(); }
  /// Of the first wheel set.
  std::span<const EncoderSample> wheels() const { return recorded.of<EncoderSample>(wheels_name); }
  /// Truth of the inertial state, if there is one.
  std::span<const StateSample> states() const { return recorded.of<StateSample>(); }
  /// Of images, for pictures.
  std::span<const ImageSample> pixels() const { return recorded.of<ImageSample>(); }
};

/// Whether measurements may still be to happen; then none may have been recorded.
enum class LiveSensors { kRefused, kAllowed };

/// Reads all sensors to their end, but for the last of a chain of sensors that take inputs: the
/// filter is going to read that one, and only once. Throws InputError when a sensor gives nothing
/// of what is wanted from it, when channels do not fit the model, or when a sensor's input is
/// broken.
RunData collect(RunSetup& setup, LiveSensors live = LiveSensors::kRefused);

/// Statistics of the time that a stage took per epoch.
struct StageTime {
  double mean_ms = 0.;
  double p95_ms = 0.;
  double max_ms = 0.;
};

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
  PreintegratedPose total;  ///< from the first to the last epoch, without the parity information
  std::vector<std::pair<double, double>> epoch_ms;        ///< time since start [s], time spent [ms]
  std::vector<std::pair<std::string, StageTime>> stages;  ///< without the total
  StageTime total_ms;                                     ///< of an epoch
  std::vector<std::pair<std::string, RejectionCount>> rejections;
  std::vector<NoiseFound> noises;     ///< "UPDATE.NAME", by updates that look for them
  std::vector<std::string> warnings;  ///< what is suspicious of the run as a whole

  // Of the filter.
  PoseNees nees;
  std::vector<PoseError> errors;  ///< where the reference is in the frame of the estimate
  std::vector<double> epoch_t_s;
  std::vector<CalibrationTrack> calibration;
  std::vector<UpdateTrack> updates;
  MonitorTrack monitor;
  /// More than one: it diverged and was started again. Those without an epoch are not here.
  std::vector<RunPiece> pieces;
  /// Whether a RunStream has written trajectory, calibration and times; here they are thinned.
  bool on_disk = false;
  std::vector<RunPicture> pictures;  ///< for the page, in time order
};

/// Integrates the wheels from the first to the last common instant, starting at the reference pose
/// (or at the origin), and evaluates. A model that throws ends the run with the epoch and the
/// cause.
RunResult run_odometry(const RunSetup& setup, const RunData& data);

/// Called now and then with the part of the log's time that is done, 0 to 1.
using OnProgress = std::function<void(double)>;

/// Called when the estimator is about to begin; returns who is to watch it, or nullptr.
using OnStart = std::function<EstimatorObserver*(const Estimator&)>;

/// Who is to know what happens in a run; any of them may be empty.
struct RunHooks {
  OnProgress progress;
  OnStart on_start;
  /// An epoch is done, and recorded in the result, which is not complete yet. The time this takes
  /// is none of the epoch's.
  std::function<void(const RunResult&)> on_epoch;
  std::function<bool()> interrupted;  ///< whether the run is to end now, with what it has
  /// Something is wrong with the run, said when it is first seen: time since the start [s], what.
  std::function<void(double, const std::string&)> on_warning;
  /// A live sensor has given an image, which is still to be worked on. In another thread.
  std::function<void(const ImageSample&)> on_live_image;
};

/// Runs the filter over all measurements and evaluates. A filter that diverges, or a kinematic
/// model that throws, ends the run with the epoch and the cause.
RunResult run_filter(const RunSetup& setup, const RunData& data, const RunHooks& hooks = {});

/// Warnings of updates that had more than a third of their factors rejected.
std::vector<std::string> contradictions(const std::vector<UpdateTrack>& updates);

/// Warnings of what a fifth of the samples was left out for, and of noises far above what is
/// configured. Stamps become times since `begin_ns`.
std::vector<std::string> suspicions(std::span<const RejectionCount> rejections,
                                    std::span<const NoiseFound> noises, std::int64_t begin_ns);

/// Warnings of calibration that has gone where its prior does not reach.
std::vector<std::string> far_from_prior(const std::vector<CalibrationTrack>& calibration);

/// What the configuration asks for.
inline RunResult run(const RunSetup& setup, const RunData& data, const RunHooks& hooks = {}) {
  return setup.filter ? run_filter(setup, data, hooks) : run_odometry(setup, data);
}

StageTime stage_time(std::vector<double> ms);

}  // namespace viwo::experiment
