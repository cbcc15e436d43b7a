// Robots of the models beyond swerve and differential, with nothing symmetric, and the twists that
// each of them can make.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "wheel_fixture.hpp"

namespace viwo::testing {

inline std::string skid_steer(const std::string& more = "") {
  return "{type: skid_steer, radius_left_m: 0.1, radius_right_m: 0.102, y_icr_left_m: 0.31, "
         "y_icr_right_m: -0.28, x_icr_m: -0.05" +
         more + "}";
}

inline std::string mecanum(const std::string& more = "") {
  return "{type: mecanum, x_m: [0.2, -0.21, -0.2, 0.19], y_m: [0.15, 0.16, -0.15, -0.14], "
         "roller_angle_rad: [-0.78, 0.79, -0.8, 0.77], radius_m: [0.05, 0.051, 0.0495, 0.0502]" +
         more + "}";
}

/// Three or six wheels that steer.
inline std::string swerve_of(int wheels) {
  return wheels == 3 ? "{type: four_wis_wid, x_m: [0.13, -0.065, -0.066], y_m: [0, 0.1126, -0.11], "
                       "radius_m: [0.0254, 0.0256, 0.0255], steer_offset_rad: [0.01, -0.02, 0]}"
                     : "{type: four_wis_wid, x_m: [0.2, 0, -0.2, -0.21, 0, 0.2], "
                       "y_m: [0.15, 0.15, 0.16, -0.15, -0.15, -0.15], "
                       "radius_m: [0.0254, 0.0256, 0.0255, 0.0253, 0.0255, 0.0257]}";
}

/// The robots above with every choice of encoders.
inline std::vector<std::string> more_bases() {
  std::vector<std::string> all;
  for (const char* speeds : {"rear", "all"}) {
    for (const char* steering : {"centre", "both"}) {
      const bool both = steering == std::string("both");
      const bool four = speeds == std::string("all");
      all.push_back("{type: ackermann, wheel_base_m: 0.32, track_m: 0.26, wheel_speeds: " +
                    std::string(speeds) + ", steering: " + steering +
                    ", radius_m: " + (four ? "[0.05, 0.0505, 0.0497, 0.0502]" : "[0.05, 0.0505]") +
                    ", steer_offset_rad: " + (both ? "[0.02, -0.01]" : "0.02") + "}");
    }
  }
  all.push_back(skid_steer());
  all.push_back(skid_steer(", left_drives: [1, 4], right_drives: [2, 3]"));
  all.push_back(mecanum());
  all.push_back(swerve_of(3));
  all.push_back(swerve_of(6));
  return all;
}

/// The twist next to `xi` that the base can make: bases that cannot crab move sideways only as
/// their centre of rotation says.
inline Twist feasible(const WheelModel& model, Twist xi) {
  EncoderSample sample;
  const RowVector no_slip = RowVector::Zero(model.n_rows());
  if (model.model().inverse({0., 0.1, 0.}, model.nominal(), no_slip, sample) == Status::kOk) {
    return xi;
  }
  const int x_icr = model.find("x_icr");
  xi.y() = x_icr < 0 ? 0. : -model.nominal()[x_icr] * xi.z();
  return xi;
}

}  // namespace viwo::testing
