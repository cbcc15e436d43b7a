// A run configuration that has been read and checked.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viwo/config/node.hpp"
#include "viwo/eval/accuracy.hpp"
#include "viwo/plugin_host/registry.hpp"
#include "viwo/setup/filter_setup.hpp"
#include "viwo/setup/routes.hpp"
#include "viwo/wheel/preintegration.hpp"

namespace viwo {

/// Where the reference body B is on the base: pose [x_m, y_m, yaw_rad] of O in B.
using PlanarExtrinsics = Eigen::Vector3d;
/// The same as viwo/math/se2.hpp has it: yaw, x, y.
inline Eigen::Vector3d as_se2(const PlanarExtrinsics& pose) { return {pose[2], pose[0], pose[1]}; }

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
  /// Of measured poses, where that is known; else B is O for the wheels alone, I for a filter.
  std::optional<PlanarExtrinsics> extrinsics;
  std::optional<PlanarExtrinsics> O_in_I;  ///< of the section `wheels`: where states are reference
  bool O_in_I_is_exact = false;            ///< no sigma of it in x, y and yaw
  double t_OtoI_s = 0.;                    ///< of the section `wheels`: t_imu = t_wheel + t_OtoI
  std::vector<SensorEntry> sensors;        ///< those that take an input behind their input
  PreintegrationOptions preintegration;
  double epoch_s = 0.1;
  double reference_time_offset_s = 0.;       ///< t_reference = t_wheel + offset
  bool knows_reference_time_offset = false;  ///< else it is t_OtoI where states are reference
  eval::Options evaluation;
  std::optional<FilterSetup> filter;           ///< nothing: dead reckoning from the wheels alone
  Routes routes;                               ///< who gets what the sensors give
  config::Mark kinematics_mark, sensors_mark;  ///< where the sections are written
  std::filesystem::path imu_file;     ///< imu.kalibr, whose numbers `resolved` has; "" for none
  config::Node resolved;              ///< all of it, with defaults: a valid run configuration
  std::vector<std::string> warnings;  ///< what is suspicious in it, for those of the result
};

/// Signs of the drives, 1 or -1, by `drive_scale` of the sensor that gives the wheels.
std::vector<int> drive_signs(const RunSetup& setup);

/// The wheels of a run without a filter, with O where the IMU is; without a model if it has none.
WheelSet wheels_alone(const RunSetup& setup);

/// Reads a run configuration without placeholders. `seed` overrules the configured one; `exact`:
/// without noise and wrong starts (HostServices::exact). Throws InputError with everything that is
/// wrong in it.
RunSetup read_run(const config::Node& run, PluginRegistry& plugins,
                  std::optional<std::uint64_t> seed = {}, bool exact = false);

}  // namespace viwo
