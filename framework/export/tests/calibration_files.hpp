// Calibrations of a base of each kind, for the tests of the formats.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "viwo/calibration_file/calibration_file.hpp"

namespace viwo::exports {

inline constexpr double kRounding = 1e-12;

inline CalibrationFile file_of(const std::string& model,
                               const std::vector<std::pair<const char*, double>>& intrinsics) {
  CalibrationFile file;
  file.path = "robot/calibration.yaml";
  file.model = model;
  file.twist = "plain";
  for (const auto& [name, value] : intrinsics) {
    const std::string text = name;
    const bool is_angle = text.starts_with("delta") || text.starts_with("gamma");
    file.intrinsics.push_back({text, value, 1e-4, value, is_angle ? "rad" : "m"});
  }
  return file;
}

inline CalibrationFile swerve() {
  return file_of("four_wis_wid", {{"r_1", 0.0501},
                                  {"r_2", 0.0502},
                                  {"r_3", 0.0503},
                                  {"r_4", 0.0504},
                                  {"x_1", 0.21},
                                  {"x_2", -0.22},
                                  {"x_3", -0.23},
                                  {"x_4", 0.24},
                                  {"y_1", 0.31},
                                  {"y_2", 0.32},
                                  {"y_3", -0.33},
                                  {"y_4", -0.34},
                                  {"delta_o1", 0.1},
                                  {"delta_o2", -2.5},
                                  {"delta_o3", 3.5},
                                  {"delta_o4", -0.4}});
}

inline CalibrationFile differential() {
  return file_of("differential", {{"r_left", 0.101}, {"r_right", 0.099}, {"baseline", 0.55}});
}

inline CalibrationFile skid_steer() {
  return file_of("skid_steer", {{"r_left", 0.101},
                                {"r_right", 0.099},
                                {"y_icr_left", 0.41},
                                {"y_icr_right", -0.39},
                                {"x_icr", -0.02}});
}

inline CalibrationFile ackermann() {
  return file_of("ackermann", {{"r_rear_left", 0.31},
                               {"r_rear_right", 0.30},
                               {"r_front_left", 0.32},
                               {"r_front_right", 0.33},
                               {"wheel_base", 2.7},
                               {"track", 1.5},
                               {"delta_o_left", 0.01},
                               {"delta_o_right", -0.02}});
}

inline CalibrationFile mecanum() {
  return file_of("mecanum", {{"r_1", 0.051},
                             {"r_2", 0.052},
                             {"r_3", 0.053},
                             {"r_4", 0.054},
                             {"gamma_1", -0.78},
                             {"gamma_2", 0.79},
                             {"gamma_3", -0.80},
                             {"gamma_4", 0.77},
                             {"k_1", -0.51},
                             {"k_2", -0.52},
                             {"k_3", 0.53},
                             {"k_4", 0.54}});
}

/// With a mount that is turned about all axes, clocks and two cameras of different kinds.
inline CalibrationFile with_rig(CalibrationFile file) {
  const char* mount[] = {"theta_ItoO_x", "theta_ItoO_y", "theta_ItoO_z",
                         "p_IinO_x",     "p_IinO_y",     "p_IinO_z"};
  for (int i = 0; i < 6; ++i) {
    file.mount.push_back({mount[i], 0.1 * (i + 1), 0.01, 0., i < 3 ? "rad" : "m"});
  }
  file.clock.push_back({"t_OtoI", 0.004, 1e-3, 0., "s"});
  for (const char* cam : {"cam0.", "cam1."}) {
    const double one = cam[3] == '0' ? 1. : 1.01;
    const std::pair<const char*, double> entries[] = {
        {"theta_ItoC_x", 1.2}, {"theta_ItoC_y", -1.21}, {"theta_ItoC_z", 1.22}, {"p_IinC_x", 0.05},
        {"p_IinC_y", 0.06},    {"p_IinC_z", -0.07},     {"fx", 285.1},          {"fy", 286.2},
        {"cx", 421.3},         {"cy", 399.4},           {"d1", -0.01},          {"d2", 0.04},
        {"d3", -0.003},        {"d4", 0.002},           {"t_CtoI", -0.0011}};
    for (const auto& [name, value] : entries) {
      file.cameras.push_back({std::string(cam) + name, one * value, 1e-3, 0., ""});
    }
  }
  file.camera_models = {{CameraDistortion::kEquidistant, 848, 800, 2.5e-5},
                        {CameraDistortion::kRadtan, 752, 480}};
  return file;
}

}  // namespace viwo::exports
