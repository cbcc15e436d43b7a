// A wheeled base in plain terms: where its wheels touch the ground, which of them are driven,
// steered or only roll along, and what the encoders are attached to (model.md). Nothing here is
// taken from the kinematic models, which are checked against it.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/kinematic_model.hpp"
#include "viwo/api/measurement.hpp"

namespace viwo::contact {

struct Params;

/// Most wheels of a base, castors included.
inline constexpr int kMaxWheels = kMaxDrives + 4;

enum class WheelKind {
  kDriven,  ///< a servo holds its speed
  kFree,    ///< rolls along
  kRoller,  ///< driven, with rollers on its rim: holds along their axis only
  kCastor,  ///< carries load, turns wherever it is pulled, has no encoder
};

struct Wheel {
  WheelKind kind = WheelKind::kDriven;
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();  ///< contact in O, or where the steering axis
                                                      ///< meets the ground
  double radius_m = 0.;                               ///< rolling radius without load
  double scrub_m = 0.;     ///< contact to the left of the steering axis, seen along the wheel
  double roller_rad = 0.;  ///< axis of the rollers on the ground, from x
  int steering = -1;       ///< channel that turns it; -1: it points along x
  /// Turned by a linkage that gives all such wheels one centre of rotation, on the line across the
  /// base through the origin; otherwise it points where its channel does.
  bool linked = false;
};

/// What one steering encoder measures: the direction of a wheel at `place_m`.
struct Steering {
  Eigen::Vector2d place_m = Eigen::Vector2d::Zero();
  double offset_rad = 0.;  ///< reading when it points along x
};

struct Base {
  std::string name;
  std::vector<Wheel> wheels;  ///< those with an encoder first, castors last
  std::vector<Steering> steerings;
  int n_drive = 0;
  /// Whether the drives alone can move it in every direction; otherwise how fast it moves sideways
  /// is up to its tyres.
  bool moves_sideways = false;
  double axle_x_m = 0.;  ///< where a base that does not move sideways has its unsteered wheels
};

/// ParamError for lists of a wrong length, and for what the base cannot have.
Base base_from(const Params& params);

/// How far the true base is from the one that was configured, standard deviations.
struct TrueBaseErrors {
  double radius_m = 0.;    ///< of each wheel with an encoder
  double position_m = 0.;  ///< of each swerve wheel but the first
  double angle_rad = 0.;   ///< of each steering offset, of a swerve base but the first
};

/// Draws of an entry depend on the seed and on its place in the base.
Base draw_base(Base nominal, const TrueBaseErrors& sigma, std::uint64_t seed);

/// The parameters of the kinematic model of that name, by its names for them; none for a base whose
/// parameters follow from how it slips. `radius_m`: rolling radii of all wheels, under load.
std::vector<CalibrationSample> intrinsics_of(const Base& base, const std::vector<double>& radius_m,
                                             std::int64_t t_ns);

/// Velocity of a point fixed to the base, p_dot + omega x r in the plane, m/s in O (CP-1).
inline Eigen::Vector2d velocity_at(const Twist& xi, const Eigen::Vector2d& r) {
  return {xi[0] - xi[2] * r.y(), xi[1] + xi[2] * r.x()};
}

inline Eigen::Vector2d direction(double angle_rad) {
  return {std::cos(angle_rad), std::sin(angle_rad)};
}

/// Across, to the left.
inline Eigen::Vector2d left_of(const Eigen::Vector2d& d) { return {-d.y(), d.x()}; }

/// Where a wheel points when its channel points along `steering_rad` (CP-2).
inline double wheel_angle(const Base& base, const Wheel& wheel, double steering_rad) {
  if (wheel.steering < 0) return 0.;
  if (!wheel.linked) return steering_rad;
  // Square to the line from the common centre of rotation to the wheel.
  const double from_axle_m =
      base.steerings[static_cast<std::size_t>(wheel.steering)].place_m.x() - base.axle_x_m;
  const double c = std::cos(steering_rad), s = std::sin(steering_rad);
  return std::atan2(from_axle_m * s, from_axle_m * c - wheel.place_m.y() * s);
}

}  // namespace viwo::contact
