// The filter's part of a run configuration: estimator, IMU, cameras, wheels, updates.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "viwo/config/errors.hpp"
#include "viwo/config/node.hpp"
#include "viwo/filter/estimator.hpp"
#include "viwo/plugin_host/registry.hpp"
#include "viwo/wheel/wheel_model.hpp"

namespace viwo::experiment {

enum class StartMode {
  kReference,   ///< the first state that the reference gives
  kStandstill,  ///< gravity and gyro bias from a rest
  kMoving,      ///< from wheels and IMU
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
};

/// A wheel set of the run: its model, its prior, and the sensor that gives its encoder samples.
struct WheelSet {
  std::string name;    ///< "" for the first: its parameters have no prefix
  std::string sensor;  ///< "" if only one sensor gives encoder samples
  std::shared_ptr<const WheelModel> model;
  WheelsPrior prior;
};

struct FilterSetup {
  EstimatorOptions options;
  StartSetup start;
  std::vector<CameraPrior> cameras;
  std::vector<WheelSet> wheels;
  struct Entry {
    std::string name;
    Loaded<Update> update;
    int wheels = -1;
    int poses = -1;  ///< index into pose_sensors
    config::Mark mark;
  };
  std::vector<Entry> updates;
  /// Sensors that updates name as `sensor`, also updates that are turned off: what they give is
  /// measurement and not reference.
  std::vector<std::string> pose_sensors;
};

/// Names of a wheel set's calibration parameters in the order of its columns: extrinsics
/// (theta_ItoO_x.. [rad], p_IinO_x.. [m]), t_OtoI [s], intrinsics.
std::vector<std::string> calibration_names(const WheelSet& wheels);

struct CalibrationValue {
  double value = 0.;
  double sigma = 0.;  ///< 0 for what is held
};

/// What a filter knows of the calibration of its wheel set `wheels`, in the order of
/// calibration_names().
std::vector<CalibrationValue> calibration_of(const Filter& filter, std::size_t wheels);

/// Reads the sections `estimator`, `imu`, `cameras`, `wheels`, `wheel_sets` and `updates` of a run
/// and appends what is wrong to `errors`. `model`, `x_WI` and `sigma` are those of the section
/// `kinematics`; `model` may be null. The resolved sections are set in `resolved`.
FilterSetup read_filter(const config::Node& run, const std::shared_ptr<const WheelModel>& model,
                        const Intrinsics& x_WI, const Intrinsics& sigma, std::uint64_t seed,
                        PluginRegistry& plugins, config::Node& resolved, config::Errors& errors);

/// Whether a run configuration has any of the sections that read_filter() reads.
bool has_filter_sections(const config::Node& run);

/// Whether a run configuration asks for the filter: estimator.type, or, if that is not said,
/// whether it has updates.
bool wants_filter(const config::Node& run);

}  // namespace viwo::experiment
