// Run configurations of a simulated robot, and a registry of the plugins of this build.
#pragma once

#include <string>

#include "registry.hpp"
#include "viwo/config/overrides.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/run/run.hpp"
#include "viwo/setup/configuration.hpp"

namespace viwo::testing {

inline const std::string kSwerve =
    "x_m: [0.1125, -0.1125, -0.1125, 0.1125], y_m: [0.1125, 0.1125, -0.1125, -0.1125], "
    "radius_m: 0.0255, prior_sigma_radius_m: 0.00005, prior_sigma_position_m: 0.001, "
    "prior_sigma_steer_offset_rad: 0.003";

/// Sensors and kinematics of a swerve robot on a circle for ten seconds: wheels, IMU, a camera.
inline std::string swerve_with_camera(int features) {
  return "sensors:\n"
         "  simulator0: {type: simulator, motion: circle, duration_s: 10, features: " +
         std::to_string(features) +
         ", cameras: " VIWO_TEST_SOURCE_DIR
         "/configs/cameras/pinhole.yaml, robot: {type: four_wis_wid, " +
         kSwerve + "}}\nkinematics: {type: four_wis_wid, " + kSwerve + "}\n";
}

/// A simulated swerve robot, 20 s of `motion`, with overrides as --set would give them.
inline config::Node simulated(const std::string& motion,
                              const std::vector<std::string>& assignments = {}) {
  config::Node run = config::parse(
      "sensors:\n"
      "  simulator0: {type: planar_simulator, motion: " +
          motion +
          ", duration_s: 20, robot: "
          "{type: four_wis_wid, " +
          kSwerve +
          "}}\n"
          "kinematics: {type: four_wis_wid, " +
          kSwerve + "}\n",
      "run.yaml");
  for (const std::string& text : assignments) {
    const auto assignment = config::parse_assignment(text);
    config::set_path(run, assignment.path, assignment.value);
  }
  return run;
}

inline RunResult run(const config::Node& configuration, std::uint64_t seed = 1) {
  auto setup = read_run(configuration, registry(), seed);
  const auto data = collect(setup);
  return run_odometry(setup, data);
}

}  // namespace viwo::testing
