#include "base.hpp"

#include <cmath>

#include "contact_params.hpp"
#include "viwo/sim/random.hpp"

namespace viwo::contact {
namespace {

/// The values of a list, repeated if there is one for all.
std::vector<double> list(const char* key, const std::vector<double>& values, std::size_t n) {
  if (values.size() == n) return values;
  if (values.size() == 1) return std::vector<double>(n, values[0]);
  throw ParamError(
      key, "has " + std::to_string(values.size()) + " values, not 1 or " + std::to_string(n));
}

void add_castors(const Params& params, Base& base) {
  const auto &x = params.castor_x_m, &y = params.castor_y_m;
  if (x.size() != y.size() || x.size() > std::size_t{kMaxWheels - kMaxDrives}) {
    throw ParamError("castor_y_m", "needs a number for each of castor_x_m, at most " +
                                       std::to_string(kMaxWheels - kMaxDrives));
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    Wheel castor;
    castor.kind = WheelKind::kCastor;
    castor.place_m = {x[i], y[i]};
    base.wheels.push_back(castor);
  }
}

/// Rear wheels that are driven, front wheels that are steered and roll along.
void make_car(const Params& params, Base& base) {
  if (base.wheels.size() != 4) {
    throw ParamError("x_m",
                     "base ackermann has four wheels: rear left, rear right, front left, "
                     "front right");
  }
  const bool centre = params.steering == "centre";
  base.n_drive = params.wheel_speeds == "rear" ? 2 : 4;
  const auto offsets = list("steer_offset_rad", params.steer_offset_rad, centre ? 1 : 2);
  for (std::size_t j = 2; j < 4; ++j) {
    Wheel& wheel = base.wheels[j];
    wheel.kind = WheelKind::kFree;
    wheel.linked = centre;
    wheel.steering = centre ? 0 : static_cast<int>(j) - 2;
    if (!centre) base.steerings.push_back({wheel.place_m, offsets[j - 2]});
  }
  if (centre) {
    base.steerings.push_back({{base.wheels[2].place_m.x(), 0.}, offsets[0]});
  }
}

}  // namespace

Base base_from(const Params& params) {
  Base base;
  base.name = params.base;
  const std::size_t n = params.x_m.size();
  if (n < 2 || n > std::size_t{kMaxDrives}) throw ParamError("x_m", "needs 2 to 8 wheels");
  if (params.y_m.size() != n) throw ParamError("y_m", "needs as many numbers as x_m");
  const auto radius = list("radius_m", params.radius_m, n);
  for (std::size_t j = 0; j < n; ++j) {
    Wheel wheel;
    wheel.place_m = {params.x_m[j], params.y_m[j]};
    wheel.radius_m = radius[j];
    base.wheels.push_back(wheel);
  }
  base.n_drive = static_cast<int>(n);
  base.moves_sideways = base.name == "swerve" || base.name == "mecanum";
  if (base.name == "swerve") {
    const auto offsets = list("steer_offset_rad", params.steer_offset_rad, n);
    for (std::size_t j = 0; j < n; ++j) {
      base.wheels[j].steering = static_cast<int>(j);
      base.wheels[j].scrub_m = params.scrub_m;
      base.steerings.push_back({base.wheels[j].place_m, offsets[j]});
    }
  } else if (base.name == "mecanum") {
    const auto angles = list("roller_angle_rad", params.roller_angle_rad, n);
    for (std::size_t j = 0; j < n; ++j) {
      base.wheels[j].kind = WheelKind::kRoller;
      base.wheels[j].roller_rad = angles[j];
    }
  } else if (base.name == "ackermann") {
    make_car(params, base);
  }
  if (!base.moves_sideways) {
    int unsteered = 0;
    for (const Wheel& wheel : base.wheels) {
      if (wheel.steering >= 0) continue;
      base.axle_x_m += wheel.place_m.x();
      ++unsteered;
    }
    base.axle_x_m /= unsteered;
  }
  add_castors(params, base);
  return base;
}

Base draw_base(Base base, const TrueBaseErrors& sigma, std::uint64_t seed) {
  sim::RandomStream stream(seed, sim::Stream::kIntrinsics);
  const bool swerve = base.name == "swerve";
  for (std::size_t j = 0; j < static_cast<std::size_t>(base.n_drive); ++j) {
    Wheel& wheel = base.wheels[j];
    wheel.radius_m += sigma.radius_m * stream.gaussian();
    const double y = stream.gaussian(), x = stream.gaussian();  // arguments have no order
    const Eigen::Vector2d draw(x, y);
    if (swerve) wheel.place_m += sigma.position_m * draw;
    if (swerve) base.steerings[j].place_m = wheel.place_m;
  }
  for (std::size_t k = 0; k < base.steerings.size(); ++k) {
    base.steerings[k].offset_rad += sigma.angle_rad * stream.gaussian();
  }
  return base;
}

std::vector<CalibrationSample> intrinsics_of(const Base& base, const std::vector<double>& radius_m,
                                             std::int64_t t_ns) {
  std::vector<CalibrationSample> out;
  const auto add = [&](const std::string& name, double value) {
    out.push_back({t_ns, name, value});
  };
  const auto each = [&](const char* name, const auto& value) {
    for (int j = 0; j < base.n_drive; ++j) {
      const auto i = static_cast<std::size_t>(j);
      add(name + std::to_string(j + 1), value(base.wheels[i], radius_m[i]));
    }
  };
  const auto& wheels = base.wheels;
  if (base.moves_sideways) each("r_", [](const Wheel&, double r) { return r; });
  if (base.name == "swerve") {
    each("x_", [](const Wheel& wheel, double) { return wheel.place_m.x(); });
    each("y_", [](const Wheel& wheel, double) { return wheel.place_m.y(); });
    each("delta_o", [&](const Wheel& wheel, double) {
      return base.steerings[static_cast<std::size_t>(wheel.steering)].offset_rad;
    });
  } else if (base.name == "mecanum") {
    each("gamma_", [](const Wheel& wheel, double) { return wheel.roller_rad; });
    each("k_", [](const Wheel& wheel, double) {
      return wheel.place_m.x() * std::tan(wheel.roller_rad) - wheel.place_m.y();
    });
  } else if (base.name == "differential") {
    const bool first_is_left = wheels[0].place_m.y() > 0.;
    add("r_left", radius_m[first_is_left ? 0 : 1]);
    add("r_right", radius_m[first_is_left ? 1 : 0]);
    add("baseline", std::abs(wheels[0].place_m.y() - wheels[1].place_m.y()));
  } else if (base.name == "ackermann") {
    const char* names[] = {"r_rear_left", "r_rear_right", "r_front_left", "r_front_right"};
    for (std::size_t j = 0; j < static_cast<std::size_t>(base.n_drive); ++j) {
      add(names[j], radius_m[j]);
    }
    add("wheel_base", wheels[2].place_m.x() - wheels[0].place_m.x());
    add("track", wheels[0].place_m.y() - wheels[1].place_m.y());
    const bool centre = base.steerings.size() == 1;
    add(centre ? "delta_o" : "delta_o_left", base.steerings[0].offset_rad);
    if (!centre) add("delta_o_right", base.steerings[1].offset_rad);
  }
  return out;
}

}  // namespace viwo::contact
