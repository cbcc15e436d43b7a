#include "contact_solver.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/LU>

#include "viwo/api/status.hpp"

namespace viwo::contact {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Below this a base stands: tyres hold it without creeping. m/s
constexpr double kStanding = 1e-3;
/// A wheel whose commanded velocity is below this keeps its direction, m/s.
constexpr double kNoDirection = 1e-6;
/// Forces are balanced to this share of the weight.
constexpr double kTolerance = 1e-10;
/// Share of the turn of a servo that friction drags its wheel along with, within their play.
constexpr double kDragged = 0.05;
constexpr int kMaxSteps = 60;
constexpr int kMaxHalvings = 20;
/// The same of one that cannot slip, m/s.
constexpr double kAtRest = 1e-9;

std::vector<double> radii_under(const Base& base, const Loads& loads, const Physics& physics) {
  std::vector<double> out;
  for (std::size_t j = 0; j < base.wheels.size(); ++j) {
    out.push_back(base.wheels[j].radius_m - physics.radius_loss_m_per_n * loads[j]);  // (CP-6)
  }
  return out;
}

/// Direction of `w` for a wheel that stands at `now`: not further than a quarter away, so a wheel
/// may roll backwards.
double nearest_direction(const Vector2d& w, double now, double at_rest_m_per_s = kNoDirection) {
  if (w.norm() < at_rest_m_per_s) return now;
  double turn = std::remainder(std::atan2(w.y(), w.x()) - now, 2. * std::numbers::pi);
  if (std::abs(turn) > 0.5 * std::numbers::pi + 1e-9) turn -= std::copysign(std::numbers::pi, turn);
  return now + turn;
}

}  // namespace

ContactSolver::ContactSolver(Base truth, Base controller, const Physics& physics)
    : truth_(std::move(truth)), controller_(std::move(controller)), physics_(physics) {
  if (!physics.slips() && (physics.steer_play_rad > 0. || physics.steer_lag_s > 0.)) {
    throw ParamError("slip_per_load", "wheels with play or lag must slip: it must not be 0");
  }
  static_radius_m_ = radii_under(truth_, static_loads(truth_, physics), physics);
  controller_radius_m_ = radii_under(controller_, static_loads(controller_, physics), physics);
  const auto n = static_cast<double>(truth_.wheels.size());
  reference_load_n_ = physics.mass_kg * physics.gravity_m_per_s2 / n;
  for (const Wheel& wheel : truth_.wheels) size_m_ += wheel.place_m.squaredNorm() / n;
  size_m_ = std::sqrt(size_m_);
}

void ContactSolver::stand(const Twist& toward) {
  slip_.setZero();
  Demand demand;
  demand.xi = toward;
  const Twist xi = actual_twist(demand, slip_);
  for (std::size_t k = 0; k < truth_.steerings.size(); ++k) {
    Steer& steer = steers_[k];
    steer.commanded_rad = nearest_direction(velocity_at(xi, controller_.steerings[k].place_m), 0.);
    steer.encoder_rad = steer.commanded_rad + controller_.steerings[k].offset_rad;
    steer.wheel_rad = steer.encoder_rad - truth_.steerings[k].offset_rad;
  }
}

bool ContactSolver::step(const Demand& demand, double dt_s, ContactState& out) {
  const Loads loads = wheel_loads(truth_, demand);
  for (std::size_t j = 0; j < truth_.wheels.size(); ++j) {
    out.wheels[j].load_n = loads[j];
    out.wheels[j].radius_m =
        truth_.wheels[j].radius_m - physics_.radius_loss_m_per_n * loads[j];  // (CP-6)
  }
  Steers steers = steers_;
  const bool found =
      physics_.slips() ? find_slip(demand, dt_s, steers, out) : roll(demand, dt_s, steers, out);
  if (found) steers_ = steers;
  return found;
}

Twist ContactSolver::commanded_twist(const Demand& demand, const Vector3d& slip) const {
  if (truth_.moves_sideways) return demand.xi + slip;  // (CP-9)
  const double omega = demand.xi[2] + slip[2];
  return {demand.xi[0] + slip[0], -controller_.axle_x_m * omega, omega};
}

Twist ContactSolver::actual_twist(const Demand& demand, const Vector3d& slip) const {
  if (truth_.moves_sideways) return demand.xi;
  return {demand.xi[0], slip[1] - truth_.axle_x_m * demand.xi[2], demand.xi[2]};  // (CP-10)
}

/// Share of the way to what it is told that a servo gets within a step.
double ContactSolver::reached(double dt_s) const {
  return physics_.steer_lag_s > 0. ? -std::expm1(-dt_s / physics_.steer_lag_s) : 1.;
}

/// What a servo does within a step, and what the play leaves of it.
ContactSolver::Steer ContactSolver::turn(std::size_t channel, const Twist& commanded,
                                         double dt_s) const {
  const Steering& known = controller_.steerings[channel];
  Steer steer = steers_[channel];
  steer.commanded_rad =
      nearest_direction(velocity_at(commanded, known.place_m), steer.commanded_rad);
  steer.encoder_rad += reached(dt_s) * (steer.commanded_rad + known.offset_rad - steer.encoder_rad);
  const double moved = steer.encoder_rad - steers_[channel].encoder_rad;
  const double free = steer.encoder_rad - truth_.steerings[channel].offset_rad;
  const double half = 0.5 * physics_.steer_play_rad;
  steer.wheel_rad =
      std::clamp(steer.wheel_rad + kDragged * moved, free - half, free + half);  // (CP-11)
  return steer;
}

/// Where a wheel touches the ground, where it points, and how fast that point is carried along.
void ContactSolver::place(const Wheel& wheel, const Twist& xi, const Steers& steers, double dt_s,
                          WheelState& state) const {
  const auto k = static_cast<std::size_t>(std::max(wheel.steering, 0));
  state.angle_rad = wheel_angle(truth_, wheel, steers[k].wheel_rad);
  const double turning =
      wheel.steering < 0 ? 0. : (steers[k].wheel_rad - steers_[k].wheel_rad) / dt_s;
  const Vector2d scrub = wheel.scrub_m * left_of(direction(state.angle_rad));
  state.place_m = wheel.place_m + scrub;
  state.velocity_m_per_s = velocity_at(xi, state.place_m) + turning * left_of(scrub);  // (CP-1)
}

/// Speed that the controller gives to a wheel.
double ContactSolver::commanded_rate(std::size_t wheel, const Twist& commanded,
                                     const Steers& steers) const {
  const Wheel& known = controller_.wheels[wheel];
  const Vector2d u = velocity_at(commanded, known.place_m);
  const double radius_m = controller_radius_m_[wheel];
  if (known.kind == WheelKind::kRoller) {
    return u.dot(direction(known.roller_rad)) / (radius_m * std::cos(known.roller_rad));
  }
  double steering = 0.;  // as the controller sees it: it does not push a wheel that is on its way
  if (known.steering >= 0) {
    const auto k = static_cast<std::size_t>(known.steering);
    steering = steers[k].encoder_rad - controller_.steerings[k].offset_rad;
  }
  return u.dot(direction(wheel_angle(controller_, known, steering))) / radius_m;
}

/// Force of the ground on a wheel; the rate of a wheel that rolls freely follows from it.
Vector2d ContactSolver::tyre_force(const Wheel& wheel, WheelState& state) const {
  const Vector2d& u = state.velocity_m_per_s;
  const double speed = std::hypot(u.norm(), kStanding), load = state.load_n;
  const double limit = physics_.friction * load;
  if (wheel.kind == WheelKind::kCastor) return -physics_.rolling_resistance * load / speed * u;
  if (!(load > 0.)) return Vector2d::Zero();
  // Force over slip velocity, along and across (CP-7).
  const double stiff =
      load * std::pow(load / reference_load_n_, physics_.load_exponent - 1.) / speed;
  const double along = stiff / physics_.slip_per_load;
  const double across = stiff / physics_.slip_angle_per_load_rad;
  const Vector2d d = direction(state.angle_rad), l = left_of(d);
  const double rim = state.radius_m * state.rate_rad_per_s;
  if (wheel.kind == WheelKind::kRoller) {
    const Vector2d axis = direction(wheel.roller_rad);
    return brush_force(along * (rim * d - u).dot(axis) * axis, limit);
  }
  if (wheel.kind == WheelKind::kFree) {
    const double drag = -physics_.rolling_resistance * load * u.dot(d) / speed;
    state.rate_rad_per_s = (u.dot(d) + drag / along) / state.radius_m;
    return drag * d + brush_force(-across * u.dot(l) * l, limit);
  }
  const Vector2d force = brush_force({along * (rim - u.dot(d)), -across * u.dot(l)}, limit);
  return force.x() * d + force.y() * l;
}

/// The base with some slip, and what its tyres lack of the demand: force along x and y, moment.
Vector3d ContactSolver::evaluate(const Demand& demand, const Vector3d& slip, double dt_s,
                                 Steers& steers, ContactState& out) const {
  out.commanded = commanded_twist(demand, slip);
  out.xi = actual_twist(demand, slip);
  for (std::size_t k = 0; k < truth_.steerings.size(); ++k) {
    steers[k] = turn(k, out.commanded, dt_s);
    out.steer_rad[k] = steers[k].encoder_rad;
  }
  Vector3d missing(demand.force_n.x(), demand.force_n.y(), demand.moment_n_m.z());
  for (std::size_t j = 0; j < truth_.wheels.size(); ++j) {
    const Wheel& wheel = truth_.wheels[j];
    WheelState& state = out.wheels[j];
    place(wheel, out.xi, steers, dt_s, state);
    state.rate_rad_per_s =
        wheel.kind == WheelKind::kCastor ? 0. : commanded_rate(j, out.commanded, steers);
    state.force_n = tyre_force(wheel, state);
    missing.head<2>() -= state.force_n;
    missing.z() -= state.place_m.x() * state.force_n.y() - state.place_m.y() * state.force_n.x();
  }
  return missing;
}

/// Newton's method on (CP-9), (CP-10).
bool ContactSolver::find_slip(const Demand& demand, double dt_s, Steers& steers,
                              ContactState& out) {
  const Vector3d units(1., 1., 1. / size_m_);
  const double weight_n = physics_.mass_kg * physics_.gravity_m_per_s2;
  const auto missing = [&](const Vector3d& slip) -> Vector3d {
    return evaluate(demand, slip.cwiseProduct(units), dt_s, steers, out).cwiseProduct(units) /
           weight_n;
  };
  double speed = std::hypot(demand.xi.head<2>().norm(), size_m_ * demand.xi[2]);
  if (speed < kStanding) {
    missing(slip_.setZero());
    return true;
  }
  Vector3d slip = slip_, r = missing(slip);
  // One step with differences over `width`; whether that brought the forces closer.
  const auto improve = [&](double width) {
    Eigen::Matrix3d J;
    for (int k = 0; k < 3; ++k) {
      J.col(k) = (missing(slip + width * Vector3d::Unit(k)) - r) / width;
    }
    const Vector3d step = -Eigen::PartialPivLU<Eigen::Matrix3d>(J).solve(r);
    double length = 1.;
    for (int halvings = 0; halvings < kMaxHalvings; ++halvings, length *= 0.5) {
      const Vector3d candidate = missing(slip + length * step);
      if (!(candidate.norm() < r.norm())) continue;
      slip += length * step;
      r = candidate;
      return true;
    }
    return false;
  };
  // Within its play a wheel hardly follows its servo: a difference across it, or from the other
  // side, may show better where to go.
  const double narrow = 1e-5 * physics_.slip_per_load * speed;
  const double wide =
      std::max(2. * physics_.steer_play_rad / reached(dt_s), physics_.slip_per_load) * speed;
  for (int i = 0; i < kMaxSteps && r.norm() > kTolerance; ++i) {
    if (!improve(narrow) && !improve(-narrow) && !improve(wide) && !improve(-wide)) break;
  }
  if (!(missing(slip).norm() < 1e3 * kTolerance)) return false;
  slip_ = slip;
  return true;
}

/// Without slip: every wheel points along the velocity of its contact and rolls by it.
bool ContactSolver::roll(const Demand& demand, double dt_s, Steers& steers,
                         ContactState& out) const {
  out.xi = actual_twist(demand, Vector3d::Zero());
  out.commanded = out.xi;
  for (std::size_t k = 0; k < truth_.steerings.size(); ++k) {
    const Steering& steering = truth_.steerings[k];
    steers[k].wheel_rad =
        nearest_direction(velocity_at(out.xi, steering.place_m), steers[k].wheel_rad, kAtRest);
    steers[k].commanded_rad = steers[k].wheel_rad;
    out.steer_rad[k] = steers[k].encoder_rad = steers[k].wheel_rad + steering.offset_rad;
  }
  for (std::size_t j = 0; j < truth_.wheels.size(); ++j) {
    const Wheel& wheel = truth_.wheels[j];
    WheelState& state = out.wheels[j];
    place(wheel, out.xi, steers, dt_s, state);
    state.force_n.setZero();
    if (wheel.kind == WheelKind::kCastor) continue;
    const Vector2d d = direction(state.angle_rad);
    const Vector2d holds = wheel.kind == WheelKind::kRoller ? direction(wheel.roller_rad) : d;
    state.rate_rad_per_s = state.velocity_m_per_s.dot(holds) / (state.radius_m * holds.dot(d));
    const double across = std::abs(state.velocity_m_per_s.dot(left_of(d)));
    const bool slides = across > kNoDirection * (1. + state.velocity_m_per_s.norm());
    if (slides && wheel.kind != WheelKind::kRoller) return false;  // (CP-2)
  }
  return true;
}

}  // namespace viwo::contact
