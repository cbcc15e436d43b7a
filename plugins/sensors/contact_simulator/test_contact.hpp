// Bases, and what they are asked to do.
#pragma once

#include <string>
#include <vector>

#include "contact_params.hpp"
#include "contact_solver.hpp"
#include "encoders.hpp"
#include "viwo/sim/body_trajectory.hpp"

namespace viwo::contact {

struct Geometry {
  std::string base;
  std::vector<double> x_m, y_m, radius_m;
  std::vector<double> steer_offset_rad = {0.};
  std::vector<double> roller_angle_rad = {0.};
  std::string wheel_speeds = "rear", steering = "centre";
};

inline Base make_base(const Geometry& g) {
  Params params;
  params.base = g.base;
  params.x_m = g.x_m;
  params.y_m = g.y_m;
  params.radius_m = g.radius_m;
  params.steer_offset_rad = g.steer_offset_rad;
  params.roller_angle_rad = g.roller_angle_rad;
  params.wheel_speeds = g.wheel_speeds;
  params.steering = g.steering;
  return base_from(params);
}

inline Base square_swerve() {
  return make_base({.base = "swerve",
                    .x_m = {0.2, -0.2, -0.2, 0.2},
                    .y_m = {0.15, 0.15, -0.15, -0.15},
                    .radius_m = {0.05}});
}

/// Tyres that slip, and nothing else.
inline Physics slipping() {
  Physics out;
  out.slip_per_load = 0.05;
  out.slip_angle_per_load_rad = 0.1;
  return out;
}

/// A base that moves with `xi` on level ground and gains `acceleration` (m/s^2 in O, that of a
/// rotating frame not in it).
inline sim::BodyMotion moving(const Twist& xi,
                              const Eigen::Vector2d& acceleration = Eigen::Vector2d::Zero()) {
  sim::BodyMotion out;
  out.v_BinG = {xi[0], xi[1], 0.};
  out.w_BwrtG_inB = {0., 0., xi[2]};
  out.a_BinG = {acceleration.x() - xi[2] * xi[1], acceleration.y() + xi[2] * xi[0], 0.};
  return out;
}

}  // namespace viwo::contact
