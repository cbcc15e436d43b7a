// The filter's part of a run configuration: estimator, IMU, cameras, wheels, updates.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viwo/config/errors.hpp"
#include "viwo/config/node.hpp"
#include "viwo/estimator/estimator.hpp"
#include "viwo/plugin_host/registry.hpp"
#include "viwo/wheel/wheel_model.hpp"

namespace viwo {

class CalibrationStart;

enum class StartMode {
  kReference,   ///< the first state that the reference gives
  kStandstill,  ///< gravity and gyro bias from a rest
  kMoving,      ///< from wheels and IMU; without wheels from cameras and IMU, or from a rest
};

/// How the filter begins, and how wrong it is made to begin.
struct StartSetup {
  StartMode mode = StartMode::kReference;
  double sigma_orientation_rad = 0.;
  double sigma_position_m = 0.;
  double sigma_velocity_m_per_s = 0.;
  double sigma_gyro_bias_rad_per_s = 0.;
  double sigma_accel_bias_m_per_s2 = 0.;
  double window_s = 1.;           ///< of data that a start without a reference looks at
  double state_error_scale = 0.;  ///< start at the reference plus this times a draw of the prior
  std::optional<ImuPrior> given = {};  ///< by whom has the filter run again
};

/// Whether a filter that has diverged is started anew.
enum class Restart { kNever, kLive, kAlways };

/// A wheel set of the run: its model and its prior.
struct WheelSet {
  std::shared_ptr<const WheelModel> model;
  WheelsPrior prior;     ///< name "" for the first: its parameters have no prefix
  PluginInfo info = {};  ///< of the model
  /// Of [x_WI, theta_ItoO, p_IinO] at the start, where what the gauge holds may be off (CAL-18);
  /// empty: each is known by itself.
  Eigen::MatrixXd correlations = {};

  /// Covariance of [x_WI, theta_ItoO, p_IinO] at the start.
  Eigen::MatrixXd P_before() const;
};

struct FilterSetup {
  EstimatorOptions options;
  StartSetup start;
  Restart restart = Restart::kLive;
  std::vector<CameraPrior> cameras;
  std::vector<WheelSet> wheels;
  struct Entry {
    std::string name;
    Loaded<Update> update;
    std::shared_ptr<Rig> rig;  ///< with its wheel set, if it is for one
    std::string sensor;        ///< `sensor: NAME`
    config::Mark mark;
    /// Another instance of it, for another estimator; empty: there is none.
    std::function<Loaded<Update>()> make_again = {};
  };
  std::vector<Entry> updates;
  /// Sensors of which updates take poses, also updates that are turned off: those are measurements
  /// and not the reference.
  std::vector<std::string> measuring;
  /// What the estimator will take, in its order.
  std::vector<SharedStream> streams;
  /// Calibration before it was made wrong by calibration_error_scale: the truth, where no sensor
  /// knows another one.
  std::map<std::string, double> drawn_from;
};

/// The estimator of a run, which has not started. `live`: measurements come as they arrive.
Estimator make_estimator(const FilterSetup& setup, bool live = false);

/// Names of the calibration parameters of a filter, in the order of the blocks.
std::vector<std::string> calibration_names(const Filter& filter);

/// Its estimates, in the same order.
std::vector<BlockEstimate> calibration_of(const Filter& filter);

/// What a run configuration is read with.
struct ReadContext {
  PluginRegistry& plugins;
  std::uint64_t seed = 1;
  bool exact = false;                 ///< HostServices::exact: no noise, no wrong start
  CalibrationStart* start = nullptr;  ///< a calibration.yaml that the run starts from
};

/// Reads the sections `estimator`, `imu`, `cameras`, `wheels`, `wheel_sets` and `updates` of a run
/// and appends what is wrong to `errors`. `model`, `x_WI` and `sigma` are those of the section
/// `kinematics`; `model` may be null. The resolved sections are set in `resolved`.
FilterSetup read_filter(const config::Node& run, const std::shared_ptr<const WheelModel>& model,
                        const Intrinsics& x_WI, const Intrinsics& sigma, const ReadContext& context,
                        config::Node& resolved, config::Errors& errors);

/// Whether a run configuration has any of the sections that read_filter() reads.
bool has_filter_sections(const config::Node& run);

/// Whether a run configuration asks for the filter: estimator.type, or, if that is not said,
/// whether it has updates.
bool wants_filter(const config::Node& run);

}  // namespace viwo
