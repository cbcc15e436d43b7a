#include "increment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "viwo/math/se2.hpp"

namespace viwo::wheel_relative_pose {

void Increment::reset(int n_intrinsics) {
  g.setZero();
  J_g_WI.setZero(3, n_intrinsics);
  P_g.setZero();
  longest_hold_s = 0.;
  gated = refused = 0;
}

void advance(const TwistSolution& twist, double dt_s, Increment& out) {
  const double omega = twist.xi[2];
  const double z = 0.5 * omega * dt_s;
  const Sinc s = sinc(z);
  const double rho = dt_s * s.value;
  const double rho_prime = 0.5 * dt_s * dt_s * s.derivative;
  const Eigen::Matrix2d R_m = R2(out.g[0] + z);
  const Eigen::Vector2d v_m = R_m * twist.xi.head<2>();
  const Eigen::Vector2d dp = rho * v_m;  // (RP-3)

  Eigen::Matrix3d Phi_tr = Eigen::Matrix3d::Identity();  // (RP-4)
  Phi_tr.block<2, 1>(1, 0) = J2() * dp;
  Eigen::Matrix3d Phi_xi = Eigen::Matrix3d::Zero();
  Phi_xi(0, 2) = dt_s;
  Phi_xi.block<2, 2>(1, 0) = rho * R_m;
  Phi_xi.block<2, 1>(1, 2) = rho_prime * v_m + 0.5 * dt_s * (J2() * dp);

  out.J_g_WI = (Phi_tr * out.J_g_WI + Phi_xi * twist.J_xi_WI).eval();  // (RP-5)
  out.P_g =
      (Phi_tr * out.P_g * Phi_tr.transpose() + Phi_xi * twist.P_xi * Phi_xi.transpose()).eval();
  out.g[0] += omega * dt_s;
  out.g.tail<2>() += dp;
}

/// Whether the reading has a twist within the gate, which is then in solution_.
bool IncrementIntegrator::is_believed(const EncoderSample& y, Increment& out) {
  const bool has_no_inverse = options_.twist.rank_tolerance == 0.;
  if (solver_.solve(y, solution_) != Status::kOk || !solution_.P_xi.allFinite() ||
      (has_no_inverse && solution_.rank_deficient)) {
    ++out.refused;
    return false;
  }
  const double gate = options_.residual_gate_m_per_s;
  if (gate > 0. && !(solution_.e.norm() <= gate)) {  // (RP-6)
    ++out.gated;
    return false;
  }
  return true;
}

bool IncrementIntegrator::integrate(std::span<const EncoderSample> samples, std::int64_t begin_ns,
                                    std::int64_t end_ns, Increment& out) {
  out.reset(solver_.model().n_intrinsics());
  const auto start_of = [&](std::size_t k) {
    return options_.holds_from_stamp ? samples[k].t_ns : samples[k].begin_ns;
  };
  if (samples.empty() || start_of(0) > begin_ns || samples.back().end_ns < end_ns) return false;
  for (std::size_t k = 0; k < samples.size() && start_of(k) < end_ns; ++k) {
    const std::int64_t stop_ns = k + 1 < samples.size() ? start_of(k + 1) : samples[k].end_ns;
    if (stop_ns <= begin_ns) continue;
    const std::int64_t from_ns = std::max(start_of(k), begin_ns);
    const std::int64_t to_ns = std::min(stop_ns, end_ns);
    if (is_believed(samples[k], out)) {
      std::swap(believed_, solution_);
      believed_from_ns_ = from_ns;
    }
    const double hold_s = believed_from_ns_ ? seconds_between(*believed_from_ns_, to_ns)
                                            : std::numeric_limits<double>::infinity();
    out.longest_hold_s = std::max(out.longest_hold_s, hold_s);
    if (believed_from_ns_) advance(believed_, seconds_between(from_ns, to_ns), out);
  }
  return true;
}

}  // namespace viwo::wheel_relative_pose
