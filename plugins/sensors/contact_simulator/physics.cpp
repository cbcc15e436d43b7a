#include "physics.hpp"

#include <algorithm>

#include <Eigen/Geometry>
#include <Eigen/QR>

namespace viwo::contact {

using Eigen::Vector3d;

Demand demand_of(const sim::BodyMotion& body, const Physics& physics) {
  const Eigen::Matrix3d R_GtoO = body.R_BtoG.transpose();
  const Vector3d v_O = R_GtoO * body.v_BinG;
  const Vector3d &w = body.w_BwrtG_inB, &dw = body.dw_BwrtG_inB, &c = physics.com_m;
  const Vector3d up(0., 0., physics.gravity_m_per_s2);
  Demand out;
  out.xi = {v_O.x(), v_O.y(), w.z()};
  out.force_n = physics.mass_kg *
                (R_GtoO * (body.a_BinG + up) + dw.cross(c) + w.cross(w.cross(c)));  // (CP-3)
  const Vector3d momentum = physics.inertia_kgm2.cwiseProduct(w);
  out.moment_n_m =
      c.cross(out.force_n) + physics.inertia_kgm2.cwiseProduct(dw) + w.cross(momentum);  // (CP-4)
  return out;
}

Loads wheel_loads(const Base& base, const Demand& demand) {
  const Vector3d wanted(demand.force_n.z(), demand.moment_n_m.x(), demand.moment_n_m.y());
  Loads loads{};
  std::array<bool, kMaxWheels> lifted{};
  for (std::size_t again = 0; again < base.wheels.size(); ++again) {
    Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
    const auto arm = [&](std::size_t j) {
      return Vector3d(1., base.wheels[j].place_m.y(), -base.wheels[j].place_m.x());
    };
    for (std::size_t j = 0; j < base.wheels.size(); ++j) {
      if (!lifted[j]) M += arm(j) * arm(j).transpose();
    }
    // Wheels on one line cannot balance all of the moment: the smallest sinking does what it can.
    const Vector3d sinking =
        Eigen::CompleteOrthogonalDecomposition<Eigen::Matrix3d>(M).solve(wanted);
    bool pulls = false;
    for (std::size_t j = 0; j < base.wheels.size(); ++j) {
      loads[j] = lifted[j] ? 0. : arm(j).dot(sinking);  // (CP-5)
      if (loads[j] >= 0.) continue;
      loads[j] = 0.;
      lifted[j] = pulls = true;
    }
    if (!pulls) break;
  }
  // What would tip over is held on its last wheels.
  double sum = 0.;
  for (const double load : loads) sum += load;
  for (double& load : loads) load *= sum > 0. ? std::max(demand.force_n.z(), 0.) / sum : 0.;
  return loads;
}

Loads static_loads(const Base& base, const Physics& physics) {
  sim::BodyMotion at_rest;
  return wheel_loads(base, demand_of(at_rest, physics));
}

Eigen::Vector2d brush_force(const Eigen::Vector2d& demand_n, double limit_n) {
  const double demand = demand_n.norm();
  if (!(demand > 0.) || !(limit_n > 0.)) return Eigen::Vector2d::Zero();
  const double z = demand / limit_n;
  const double share = z < 3. ? 1. - z / 3. + z * z / 27. : 1. / z;  // (CP-8)
  return share * demand_n;
}

}  // namespace viwo::contact
