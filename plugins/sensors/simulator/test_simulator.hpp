// Configurations of the simulator for its tests.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "support.hpp"

namespace viwo {

inline constexpr const char* kSwerve =
    "robot: {type: four_wis_wid, x_m: [0.1125, -0.1125, -0.1125, 0.1125], "
    "y_m: [0.1125, 0.1125, -0.1125, -0.1125], radius_m: 0.0255}";
inline constexpr const char* kDifferential =
    "robot: {type: differential, radius_left_m: 0.1, radius_right_m: 0.1, baseline_m: 0.5}";
inline const std::string kCameras =
    std::string("cameras: ") + VIWO_TEST_SOURCE_DIR + "/configs/cameras/t265_like.yaml";

inline std::string section_of(const std::string& rest, const std::string& robot = kSwerve) {
  return "{type: simulator, " + robot + ", " + kCameras + ", " + rest + "}";
}

inline std::map<std::string, double> calibration_of(const std::vector<Measurement>& all) {
  std::map<std::string, double> out;
  for (const auto& sample : only<CalibrationSample>(all)) out[sample.name] = sample.value;
  return out;
}

/// Every error that a camera can have.
inline const std::string kWrongCameras =
    ", camera_clock_error_s: [0.004, -0.0025], sigma_true_camera_orientation_rad: 0.02, "
    "sigma_true_camera_position_m: 0.01, sigma_true_camera_focal_px: 3, "
    "sigma_true_camera_distortion: 0.002";

}  // namespace viwo
