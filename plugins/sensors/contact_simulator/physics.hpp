// Forces on a base that moves as it does, and what its tyres make of slip (model.md).
#pragma once

#include <array>

#include <Eigen/Core>

#include "base.hpp"
#include "viwo/sim/body_trajectory.hpp"

namespace viwo::contact {

struct Physics {
  double gravity_m_per_s2 = 9.81;
  double mass_kg = 30.;
  Eigen::Vector3d com_m = {0., 0., 0.15};  ///< centre of mass in O
  Eigen::Vector3d inertia_kgm2 = {0.6, 0.6, 0.9};
  double slip_per_load = 0.;            ///< slip of a wheel that pulls its own load; 0: none slips
  double slip_angle_per_load_rad = 0.;  ///< slip angle of a wheel that is pulled sideways by it
  double load_exponent = 0.9;           ///< of the stiffness over the load
  double friction = 0.8;
  double rolling_resistance = 0.;   ///< of free wheels and castors, over the load
  double radius_loss_m_per_n = 0.;  ///< rolling radius lost with load
  double steer_play_rad = 0.;       ///< full width, between a steering encoder and its wheel
  double steer_lag_s = 0.;          ///< time constant of the steering servos

  bool slips() const { return slip_per_load > 0.; }
};

/// What the ground has to do to the base, about O and in O.
struct Demand {
  Twist xi = Twist::Zero();
  Eigen::Vector3d force_n = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment_n_m = Eigen::Vector3d::Zero();
};

/// (CP-3), (CP-4).
Demand demand_of(const sim::BodyMotion& body, const Physics& physics);

using Loads = std::array<double, kMaxWheels>;

/// Loads of the wheels on equally stiff springs; a wheel that would pull is lifted (CP-5).
Loads wheel_loads(const Base& base, const Demand& demand);

/// Loads at rest on a level ground.
Loads static_loads(const Base& base, const Physics& physics);

/// Brush model: `demand_n` is what a tyre of that stiffness without a limit would give, `limit_n`
/// what friction allows (CP-8).
Eigen::Vector2d brush_force(const Eigen::Vector2d& demand_n, double limit_n);

}  // namespace viwo::contact
