// Pieces of motion that a plan is made of, from rest to rest, as fast as the limits of a base
// allow. Equations: docs/math/plan.md.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "viwo/plan/information.hpp"

namespace viwo::plan {

/// What the base may do.
struct LimitParams {
  double max_speed_m_per_s = 0.5;
  double max_yaw_rate_rad_per_s = 1.;
  double max_acceleration_m_per_s2 = 0.5;
  double min_turn_radius_m = 0.;
  double base_radius_m = 0.;
  double floor_x_m = 0.;
  double floor_y_m = 0.;
  double pause_s = 0.5;
  double rate_hz = 100.;

  /// Some are required.
  void bind(ParamBinder& b);
};

/// A shape in the plane: d g / d u for u from 0 to 1, as a twist [m, m, rad] of O in O.
struct Shape {
  std::string name;
  std::function<Twist(double u)> f;
};

/// A shape that is driven, followed by a pause.
struct Piece {
  std::string name;
  std::function<Twist(double t_s)> twist;  ///< zero before and after
  double duration_s = 0.;                  ///< with the pause
  double cost_m = 0.;                      ///< path of the fastest point of the base (PL-3)
  double path_m = 0.;                      ///< path of O
  std::vector<Eigen::Vector3d> poses;      ///< [yaw, x, y] on the way, of O from its start
  Information information;

  const Eigen::Vector3d& end() const { return poses.back(); }
};

/// The shortest time in which a shape keeps the limits (PL-4), and what it costs; no information.
Piece drive(const Shape& shape, const LimitParams& limits);

/// All shapes that are tried, for a base of this radius.
std::vector<Shape> shapes_for(double base_radius_m);

/// Encoder samples of a twist at the nominal intrinsics, without noise. InputError for a base that
/// cannot follow.
std::vector<EncoderSample> exact_encoders(const WheelModel& model,
                                          const std::function<Twist(double t_s)>& twist,
                                          double duration_s, double rate_hz);

/// The pieces that the base can drive, with what they tell.
std::vector<Piece> make_pieces(WheelInformation& wheels, const LimitParams& limits);

/// Whether a base that drives `piece` from `start` stays on the floor, whose middle is the origin.
bool stays_on_floor(const Piece& piece, const Eigen::Vector3d& start, const LimitParams& limits);

}  // namespace viwo::plan
