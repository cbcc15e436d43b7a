// Motions of a base in the plane, as the twist of O in O over time, and the poses they lead to.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/kinematic_model.hpp"

namespace viwo::sim {

struct MotionOptions {
  double speed_m_per_s = 0.5;
  double yaw_rate_rad_per_s = 0.6;  ///< constant or peak rate of the motions that turn
  double ramp_s = 1.;               ///< smooth start from rest; 0: at speed from the beginning
  Eigen::Vector2d pivot_m = Eigen::Vector2d::Zero();  ///< what `pivot` turns about, in O
};

/// One of the motions below, by name. With v the speed and w the yaw rate:
///
///   icr_sweep          speed v (1 + 0.3 sin), its direction and the yaw rate swing with different
///                      frequencies: the instantaneous centre of rotation sweeps around the base
///   straight           [v, 0, 0]
///   lateral            [0, v, 0]
///   circle             [v, 0, w]
///   stationary         [0, 0, 0]
///   figure_eight       [v, 0, w sin]: a closed eight
///   crab_varying       speed v in a direction that swings, no rotation
///   spin               [0, 0, w]
///   constant_steering  [v, 0, w] (1 + 0.5 sin): a circle at varying speed
///   sweep_then_straight  icr_sweep for 20 s, then within 2 s into [v, 0, 0]
///   mixed                20 s each of icr_sweep, straight, circle, lateral, standing and a circle
///                        driven backwards the other way, and again, with changes of 2 s
///   pivot              w (1 + 0.5 sin) about a point of the base: a wheel there does not roll
///
/// The ramp slows the beginning of a motion down and leaves the path as it is: the motion at time t
/// is that without a ramp at progress(t).
class PlanarMotion {
 public:
  /// InputError for an unknown name (with the known ones).
  explicit PlanarMotion(std::string_view name, const MotionOptions& options = {});
  /// Any other motion: `twist` at t seconds, twice continuously differentiable; driven as it is.
  PlanarMotion(std::string name, std::function<Twist(double t_s)> twist);

  static const std::vector<std::string>& names();
  const std::string& name() const { return name_; }

  /// [v_x, v_y, omega] of O in O at `t` seconds, m/s and rad/s; twice continuously differentiable.
  Twist twist(double t) const;
  /// Integral of the ramp: t for no ramp, t - ramp_s / 2 after it, 0 for t <= 0.
  double progress(double t) const;

 private:
  using Profile = Twist (*)(double t, const MotionOptions& options);
  struct Entry;
  static const std::vector<Entry>& entries();

  std::string name_;
  MotionOptions options_;
  Profile profile_ = nullptr;
  std::function<Twist(double)> given_;  ///< instead of a profile
};

/// 0 for u <= 0, 1 for u >= 1, twice continuously differentiable; and its integral.
double smooth_step(double u);
double smooth_step_integral(double u);

/// Period of figure_eight, s: the eight closes when the heading swings by +-j0 (the first zero of
/// the Bessel function J0), hence 2 pi j0 / w.
double figure_eight_period_s(const MotionOptions& options);

/// Integrates a motion: g = [yaw, x, y] of O in G with g = 0 at t = start_s, yaw not wrapped.
///
/// Fourth-order Magnus steps on SE(2) of at most `max_step_s`: the twist at the two Gauss points
/// and the exact exponential, so that constant twists are exact for any step.
class PoseIntegrator {
 public:
  explicit PoseIntegrator(const PlanarMotion& motion, double max_step_s = 1e-3,
                          double start_s = 0.);

  /// The pose at `t` >= start_s; calls must be in time order (std::logic_error otherwise).
  const Eigen::Vector3d& advance_to(double t);

 private:
  void step(double h);

  PlanarMotion motion_;
  double max_step_s_;
  double t_;
  Eigen::Vector3d g_ = Eigen::Vector3d::Zero();
};

}  // namespace viwo::sim
