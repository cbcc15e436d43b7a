#include "viwo/plan/pieces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "viwo/math/se2.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/sim/encoder_simulator.hpp"
#include "viwo/sim/planar_motion.hpp"

namespace viwo::plan {
namespace {

constexpr double kFirstZeroOfJ0 = 2.404825557695773;
/// Parts of the time in which a piece begins to move, and in which it comes to rest.
constexpr double kRises[] = {0.03, 0.06, 0.12, 0.25};
constexpr double kPoseStep_s = 0.02;
constexpr double kLongest_s = 600.;

/// u and its rate after a part `tau` of the time, both for a time of one.
struct Progress {
  double u, rate;
};

Progress progress_at(double tau, double rise) {
  const double whole = 1. - rise;
  const bool rising = tau < 0.5;
  const double from_end = (rising ? tau : 1. - tau) / rise;
  const double part = rise / whole * sim::smooth_step_integral(from_end);
  return {rising ? part : 1. - part, sim::smooth_step(from_end) / whole};
}

/// Twist of a shape that is driven within one second.
Twist unit_twist(const Shape& shape, double tau, double rise) {
  const Progress progress = progress_at(tau, rise);
  return shape.f(progress.u) * progress.rate;
}

/// (PL-4)
double shortest_time_s(const Shape& shape, double rise, const LimitParams& limits) {
  constexpr int kSteps = 2000;
  constexpr double kDifference = 1e-4;
  double speed = 0., yaw_rate = 0., acceleration = 0.;
  for (int i = 0; i <= kSteps; ++i) {
    const double tau = std::clamp(static_cast<double>(i) / kSteps, kDifference, 1. - kDifference);
    const Twist xi = unit_twist(shape, tau, rise);
    const Twist rate =
        (unit_twist(shape, tau + kDifference, rise) - unit_twist(shape, tau - kDifference, rise)) /
        (2. * kDifference);
    const Eigen::Vector2d of_O = rate.head<2>() + xi[2] * (J2() * xi.head<2>());
    speed = std::max(speed, xi.head<2>().norm() + limits.base_radius_m * std::abs(xi[2]));
    yaw_rate = std::max(yaw_rate, std::abs(xi[2]));
    acceleration = std::max(
        acceleration, of_O.norm() + limits.base_radius_m * (std::abs(rate[2]) + xi[2] * xi[2]));
  }
  constexpr double kBetweenSteps = 1.002;
  return kBetweenSteps *
         std::max({speed / limits.max_speed_m_per_s, yaw_rate / limits.max_yaw_rate_rad_per_s,
                   std::sqrt(acceleration / limits.max_acceleration_m_per_s2)});
}

/// How a shape is driven: in which time, a whole number of samples, with which rise.
struct Pace {
  double time_s = std::numeric_limits<double>::infinity();
  double rise = 0.;
};

double whole_samples(double seconds, const LimitParams& limits) {
  return std::ceil(seconds * limits.rate_hz) / limits.rate_hz;
}

Pace fastest(const Shape& shape, const LimitParams& limits) {
  Pace pace;
  for (const double rise : kRises) {
    const double time_s = whole_samples(shortest_time_s(shape, rise, limits), limits);
    if (time_s < pace.time_s) pace = {time_s, rise};
  }
  return pace;
}

bool turns_too_tightly(const Shape& shape, double min_turn_radius_m) {
  constexpr int kSteps = 100;
  for (int i = 0; i <= kSteps; ++i) {
    const Twist f = shape.f(static_cast<double>(i) / kSteps);
    if (f.head<2>().norm() < min_turn_radius_m * std::abs(f[2]) * (1. - 1e-9)) return true;
  }
  return false;
}

std::string degrees(double direction_rad) {
  return significant(std::round(direction_rad * 180. / M_PI), 3) + " deg";
}

Twist along(double length_m, double direction_rad, double turn_rad) {
  return {length_m * std::cos(direction_rad), length_m * std::sin(direction_rad), turn_rad};
}

Shape constant(const Twist& f) {
  std::string name;
  const double length_m = f.head<2>().norm();
  if (length_m == 0.) {
    name = "spin by " + significant(f[2], 2) + " rad";
  } else if (f[2] == 0.) {
    name = "straight " + significant(length_m, 2) + " m at " + degrees(std::atan2(f[1], f[0]));
  } else {
    const auto at = [](double value) {
      return significant(std::abs(value) < 1e-9 ? 0. : value, 2);
    };
    name = "turn by " + significant(f[2], 2) + " rad about (" + at(-f[1] / f[2]) + ", " +
           at(f[0] / f[2]) + ") m";
  }
  return {name, [f](double) { return f; }};
}

void add_constant(double rho, std::vector<Shape>& out) {
  for (const double size : {1., 2., 4., 8., 16., 32.}) {
    const double rim_m = size * rho;
    for (const double sign : {1., -1.}) out.push_back(constant({0., 0., sign * size}));
    for (int k = 0; k < 8; ++k) {
      const double direction = wrap_angle(k * M_PI / 4.);
      Twist forward = along(rim_m, direction, 0.);
      if (k % 4 == 0) forward[1] = 0.;  // a sine of pi is not zero
      if (k % 4 == 2) forward[0] = 0.;
      out.push_back(constant(forward));
      // Parts of the speed of the rim that are of the turn: centres at 4, 1.5 and 0.67 radii.
      for (const double part : {0.2, 0.4, 0.6}) {
        for (const double sign : {1., -1.}) {
          Twist f = (1. - part) * forward;
          f[2] = sign * part * size;
          out.push_back(constant(f));
        }
      }
    }
  }
}

void add_eights(double rho, std::vector<Shape>& out) {
  for (const double size : {12., 30.}) {
    for (int k = 0; k < 4; ++k) {
      Twist forward = along(size * rho, k * M_PI / 2., 0.);
      forward[k % 2 == 0 ? 1 : 0] = 0.;
      // It closes when the heading swings by the first zero of J0 either way.
      out.push_back({"figure eight of " + significant(size * rho, 2) + " m at " +
                         degrees(wrap_angle(k * M_PI / 2.)),
                     [forward](double u) -> Twist {
                       Twist f = forward;
                       f[2] = 2. * M_PI * kFirstZeroOfJ0 * std::sin(2. * M_PI * u);
                       return f;
                     }});
    }
  }
}

void add_sweeps(double rho, std::vector<Shape>& out) {
  constexpr double kSwing_rad = 1.5;
  constexpr double kTurningPart = 0.4;
  for (const double size : {8., 16., 32.}) {
    const std::string rim = significant(size * rho, 2) + " m";
    for (int k = 0; k < 4; ++k) {
      const double start = wrap_angle(k * M_PI / 2.);
      out.push_back({"crab " + rim + " about " + degrees(start), [size, rho, start](double u) {
                       const double swing = kSwing_rad * std::sin(2. * M_PI * u);
                       return along(size * rho, start + swing, 0.);
                     }});
      for (const double round : {2. * M_PI, -2. * M_PI}) {
        out.push_back({"circle of " + rim + " without turning, from " + degrees(start) +
                           (round < 0. ? ", clockwise" : ""),
                       [size, rho, start, round](double u) {
                         return along(size * rho, start + round * u, 0.);
                       }});
      }
      for (const double turn : {kTurningPart * size, -kTurningPart * size}) {
        for (const double against : {1., 2.}) {
          const double length_m = (1. - kTurningPart) * size * rho;
          out.push_back(
              {"drive " + significant(length_m, 2) + " m from " + degrees(start) + " and turn by " +
                   significant(turn, 2) + " rad, wheels turn by " +
                   significant(-against * turn, 2) + " rad",
               [=](double u) { return along(length_m, start - against * turn * u, turn); }});
        }
      }
    }
  }
}

/// Stretches of the motion icr_sweep, either way.
void add_icr_sweeps(double rho, std::vector<Shape>& out) {
  const sim::MotionOptions options{2. * rho, 0.6, 0., Eigen::Vector2d::Zero()};
  const sim::PlanarMotion sweep("icr_sweep", options);
  for (const double length_s : {1., 2., 4., 8., 16., 32.}) {
    for (double from_s = 0.; from_s < 100.; from_s += 10.) {
      for (const double way : {1., -1.}) {
        out.push_back({"ICR sweep from " + significant(from_s, 3) + " to " +
                           significant(from_s + length_s, 3) + " s" +
                           (way < 0. ? ", backwards" : ""),
                       [=](double u) -> Twist {
                         return way * length_s * sweep.twist(from_s + u * length_s);
                       }});
      }
    }
  }
}

}  // namespace

void LimitParams::bind(ParamBinder& b) {
  b(VIWO_PARAM(max_speed_m_per_s),
    {.unit = "m/s", .above = 0., .max = 20., .help = "of the fastest point of the base"});
  b(VIWO_PARAM(max_yaw_rate_rad_per_s),
    {.unit = "rad/s", .above = 0., .max = 20., .help = "of the base"});
  b(VIWO_PARAM(max_acceleration_m_per_s2),
    {.unit = "m/s^2", .above = 0., .max = 50., .help = "of any point of the base"});
  b(VIWO_PARAM(min_turn_radius_m),
    {.unit = "m", .min = 0., .help = "of O; 0: the base turns in place, if its model can"});
  b(VIWO_PARAM(base_radius_m), {.unit = "m",
                                .above = 0.,
                                .max = 100.,
                                .required = true,
                                .help = "of the circle about O that the base fills"});
  b(VIWO_PARAM(floor_x_m), {.unit = "m",
                            .above = 0.,
                            .required = true,
                            .help = "size of the floor ahead and behind; the base begins in its "
                                    "middle, heading along x"});
  b(VIWO_PARAM(floor_y_m),
    {.unit = "m", .above = 0., .required = true, .help = "size of the floor to the sides"});
  b(VIWO_PARAM(pause_s),
    {.unit = "s", .min = 0., .max = 60., .help = "rest behind each piece, in which wheels steer"});
  b(VIWO_PARAM(rate_hz),
    {.unit = "Hz", .min = 10., .max = 1000., .help = "rate of the encoder samples"});
}

std::vector<Shape> shapes_for(double base_radius_m) {
  std::vector<Shape> out;
  add_constant(base_radius_m, out);
  add_eights(base_radius_m, out);
  add_sweeps(base_radius_m, out);
  add_icr_sweeps(base_radius_m, out);
  return out;
}

Piece drive(const Shape& shape, const LimitParams& limits) {
  Piece piece;
  piece.name = shape.name;
  const auto [T, rise] = fastest(shape, limits);
  piece.duration_s = T + whole_samples(limits.pause_s, limits);
  piece.twist = [shape, T = T, rise = rise](double t_s) -> Twist {
    if (t_s <= 0. || t_s >= T) return Twist::Zero();
    return unit_twist(shape, t_s / T, rise) / T;
  };
  sim::PoseIntegrator integrator(sim::PlanarMotion(piece.name, piece.twist), 0.005);
  const auto steps = static_cast<int>(std::ceil(T / kPoseStep_s));
  for (int k = 0; k <= steps; ++k) {
    const double t_s = T * k / steps;
    piece.poses.push_back(integrator.advance_to(t_s));
    const Twist xi = piece.twist(t_s);  // zero at both ends: sums are trapezoidal
    piece.path_m += xi.head<2>().norm() * T / steps;
    piece.cost_m +=  // (PL-3)
        (xi.head<2>().norm() + limits.base_radius_m * std::abs(xi[2])) * T / steps;
  }
  return piece;
}

std::vector<EncoderSample> exact_encoders(const WheelModel& model,
                                          const std::function<Twist(double t_s)>& twist,
                                          double duration_s, double rate_hz) {
  sim::EncoderSimulation simulation;
  simulation.make_exact();
  simulation.duration_s = duration_s;
  simulation.rate_hz = rate_hz;
  return sim::simulate_encoders(model.model(), model.nominal(), twist, "plan", simulation, 1);
}

std::vector<Piece> make_pieces(WheelInformation& wheels, const LimitParams& limits) {
  std::vector<Piece> out;
  for (const Shape& shape : shapes_for(limits.base_radius_m)) {
    if (turns_too_tightly(shape, limits.min_turn_radius_m)) continue;
    if (!(fastest(shape, limits).time_s <= kLongest_s)) continue;
    Piece piece = drive(shape, limits);
    try {
      const auto samples =
          exact_encoders(wheels.model(), piece.twist, piece.duration_s, limits.rate_hz);
      piece.information = wheels.of(samples, samples.front().begin_ns, samples.back().end_ns);
    } catch (const InputError&) {
      continue;  // this base cannot follow it
    }
    out.push_back(std::move(piece));
  }
  return out;
}

bool stays_on_floor(const Piece& piece, const Eigen::Vector3d& start, const LimitParams& limits) {
  // Between two poses the base is nearer to one of them than half a step.
  const double taken_m = limits.base_radius_m + 0.5 * limits.max_speed_m_per_s * kPoseStep_s;
  const double room_x_m = 0.5 * limits.floor_x_m - taken_m;
  const double room_y_m = 0.5 * limits.floor_y_m - taken_m;
  return std::all_of(piece.poses.begin(), piece.poses.end(), [&](const Eigen::Vector3d& pose) {
    const Eigen::Vector3d at = compose(start, pose);
    return std::abs(at[1]) <= room_x_m && std::abs(at[2]) <= room_y_m;
  });
}

}  // namespace viwo::plan
