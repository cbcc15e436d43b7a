// Drives that a plan is compared with: an ICR sweep and random driving, within the same limits and
// on the same floor.
#pragma once

#include <optional>
#include <random>

#include "viwo/math/se2.hpp"
#include "viwo/plan/plan.hpp"
#include "viwo/sim/planar_motion.hpp"

namespace viwo::testing {

using plan::Piece;
using plan::Shape;

/// Pieces one after the other; never ends.
using NextPiece = std::function<Piece(const Eigen::Vector3d& at)>;

class Uniform {
 public:
  explicit Uniform(std::uint64_t seed) : random_(seed) {}
  double operator()(double least, double most) {
    return least + (most - least) * std::ldexp(static_cast<double>(random_() >> 11), -53);
  }

 private:
  std::mt19937_64 random_;
};

/// Constant twists of any direction, any part of turning and any length from 2 to 16 radii of the
/// base; what leaves the floor is drawn again.
inline NextPiece random_driving(const plan::PlanSetup& setup, std::uint64_t seed) {
  return [&setup, uniform = Uniform(seed)](const Eigen::Vector3d& at) mutable {
    for (;;) {
      const double rho = setup.params.base_radius_m;
      const double size = 2. * std::pow(8., uniform(0., 1.));
      const double part = uniform(-1., 1.), direction = uniform(-M_PI, M_PI);
      const double length_m = (1. - std::abs(part)) * size * rho;
      const Twist f(length_m * std::cos(direction), length_m * std::sin(direction), part * size);
      Piece piece = drive({"random", [f](double) { return f; }}, setup.params);
      if (stays_on_floor(piece, at, setup.params)) return piece;
    }
  };
}

/// The motion icr_sweep of the simulators from a time of its own, cut where the floor ends, then on
/// the other way round.
inline NextPiece icr_sweep(const plan::PlanSetup& setup, std::uint64_t seed) {
  Uniform uniform(seed);
  return [&setup, from_s = uniform(0., 100.), sign = 1.](const Eigen::Vector3d& at) mutable {
    for (double length_s = 20.;; length_s *= 0.8) {
      for (const double way : {sign, -sign}) {
        const sim::PlanarMotion sweep("icr_sweep", {0.5, 0.6, 0., Eigen::Vector2d::Zero()});
        Piece piece = drive({"sweep",
                             [sweep, way, from = from_s, length_s](double u) -> Twist {
                               return way * length_s * sweep.twist(from + u * length_s);
                             }},
                            setup.params);
        if (!stays_on_floor(piece, at, setup.params)) continue;
        from_s += length_s;
        sign = way;
        return piece;
      }
    }
  };
}

/// A drive up to where its information reaches the goals, or a bit more.
struct Driven {
  std::vector<Piece> pieces;
  double cost_m = 0.;      ///< until the goals are reached, in the middle of a piece
  double duration_s = 0.;  ///< likewise
};

inline double rim_speed(const Piece& piece, double t_s, double base_radius_m) {
  const Twist xi = piece.twist(t_s);
  return xi.head<2>().norm() + base_radius_m * std::abs(xi[2]);
}

inline Driven drive_to_goals(const plan::PlanSetup& setup, const NextPiece& next) {
  constexpr double kStep_s = 0.1;
  plan::WheelInformation wheels(setup.model, setup.params);
  plan::Information driven = plan::Information::zero(setup.model->n_intrinsics());
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  Driven out;
  for (;;) {
    const Piece piece = next(at);
    const auto samples =
        plan::exact_encoders(*setup.model, piece.twist, piece.duration_s, setup.params.rate_hz);
    const std::int64_t begin_ns = samples.front().begin_ns, end_ns = samples.back().end_ns;
    out.pieces.push_back(piece);
    const auto to_goal = [&](std::int64_t to_ns) {
      plan::Information here = driven;
      here += wheels.of(samples, begin_ns, to_ns);
      return worst_goal(setup.goals, wheels.sigma(here)).ratio;
    };
    const bool last = to_goal(end_ns) <= 1.;
    for (double t_s = kStep_s; t_s < piece.duration_s; t_s += kStep_s) {
      out.cost_m += kStep_s * rim_speed(piece, t_s - 0.5 * kStep_s, setup.params.base_radius_m);
      out.duration_s += kStep_s;
      if (last && to_goal(begin_ns + std::llround(t_s * 1e9)) <= 1.) return out;
    }
    if (last) return out;
    driven += wheels.of(samples, begin_ns, end_ns);
    at = compose(at, piece.end());
  }
}

}  // namespace viwo::testing
