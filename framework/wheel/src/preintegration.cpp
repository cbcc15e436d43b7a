#include "viwo/wheel/preintegration.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "viwo/math/chi2.hpp"
#include "viwo/math/se2.hpp"

namespace viwo {
namespace {

/// Readings of `a` moved towards those of `b`: (1 - weight) a + weight b.
EncoderSample blend(const EncoderSample& a, const EncoderSample& b, double weight) {
  EncoderSample mixed = a;
  for (std::size_t i = 0; i < static_cast<std::size_t>(a.n_drive); ++i) {
    mixed.drive_rad_per_s[i] += weight * (b.drive_rad_per_s[i] - a.drive_rad_per_s[i]);
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(a.n_steer); ++i) {
    mixed.steer_rad[i] += weight * (b.steer_rad[i] - a.steer_rad[i]);
  }
  return mixed;
}

/// The piece [begin_ns, end_ns] of sample k, read at its middle; `weight` is how much of the
/// neighbour went in (negative: the neighbour before).
EncoderSample cut(std::span<const EncoderSample> samples, std::size_t k, std::int64_t begin_ns,
                  std::int64_t end_ns, double& weight) {
  const EncoderSample& sample = samples[k];
  const std::int64_t middle_ns = begin_ns + (end_ns - begin_ns) / 2;
  const bool later = middle_ns > sample.t_ns;
  weight = 0.;
  if (later ? k + 1 >= samples.size() : k == 0) return sample;
  const EncoderSample& neighbour = later ? samples[k + 1] : samples[k - 1];
  const bool adjacent =
      later ? neighbour.begin_ns == sample.end_ns : neighbour.end_ns == sample.begin_ns;
  if (!adjacent || neighbour.t_ns == sample.t_ns) return sample;
  weight = seconds_between(sample.t_ns, middle_ns) / seconds_between(sample.t_ns, neighbour.t_ns);
  const EncoderSample mixed = blend(sample, neighbour, weight);
  if (!later) weight = -weight;
  return mixed;
}

}  // namespace

void PreintegratedPose::reset(int n_intrinsics) {
  *this = PreintegratedPose{};
  J_g_WI.setZero(3, n_intrinsics);
  parity.reset(n_intrinsics);
}

void append(PreintegratedPose& total, const PreintegratedPose& next) {
  const Eigen::Matrix2d R = R2(total.g[0]);
  const Eigen::Vector2d dp = R * next.g.tail<2>();
  Eigen::Matrix3d by_total = Eigen::Matrix3d::Identity();
  by_total.block<2, 1>(1, 0) = J2() * dp;
  Eigen::Matrix3d by_next = Eigen::Matrix3d::Identity();
  by_next.block<2, 2>(1, 1) = R;
  const IntrinsicJacobian J = by_total * total.J_g_WI + by_next * next.J_g_WI;
  total.J_g_WI = J;
  total.P_g =
      (by_total * total.P_g * by_total.transpose() + by_next * next.P_g * by_next.transpose())
          .eval();
  total.g[0] += next.g[0];
  total.g.tail<2>() += dp;
  total.parity.Lambda += next.parity.Lambda;
  total.parity.eta += next.parity.eta;
  total.parity.chi2 += next.parity.chi2;
  total.parity.dof += next.parity.dof;
  total.duration_s += next.duration_s;
  total.path_length_m += next.path_length_m;
  total.bridged_s += next.bridged_s;
  total.samples += next.samples;
  total.gated += next.gated;
  total.rejected += next.rejected;
  total.rank_deficient += next.rank_deficient;
}

Preintegrator::Preintegrator(std::shared_ptr<const WheelModel> model,
                             const PreintegrationOptions& options)
    : options_(options), solver_(std::move(model), options.twist) {
  solution_.J_xi_WI.setZero(3, solver_.model().n_intrinsics());
  believed_ = solution_;
}

bool Preintegrator::integrate(std::span<const EncoderSample> samples, std::int64_t begin_ns,
                              std::int64_t end_ns, PreintegratedPose& out) {
  out.reset(solver_.model().n_intrinsics());
  has_believed_ = false;
  const auto after_begin = [&](const EncoderSample& sample) { return sample.end_ns <= begin_ns; };
  const auto first = std::partition_point(samples.begin(), samples.end(), after_begin);
  std::int64_t reached_ns = begin_ns;
  bool covered = true;
  double previous_weight = 0.;  // share of this sample that went into the piece before
  for (auto k = static_cast<std::size_t>(first - samples.begin());
       k < samples.size() && samples[k].begin_ns < end_ns; ++k) {
    const EncoderSample& sample = samples[k];
    if (sample.begin_ns > reached_ns) {
      if (out.samples == 0) {
        covered = false;
      } else {
        // A hole: the mean of its neighbours, a piece of its own.
        const double dt = seconds_between(reached_ns, sample.begin_ns);
        add_piece(blend(samples[k - 1], sample, 0.5), dt, {}, out);
        out.bridged_s += dt;
        --out.samples;
        previous_weight = 0.;
      }
    }
    const std::int64_t from_ns = std::max(sample.begin_ns, begin_ns);
    const std::int64_t to_ns = std::min(sample.end_ns, end_ns);
    const double dt = seconds_between(from_ns, to_ns);
    if (from_ns == sample.begin_ns && to_ns == sample.end_ns) {
      add_piece(sample, dt, {1., previous_weight}, out);
      previous_weight = 0.;
    } else {
      double weight = 0.;
      const EncoderSample piece = cut(samples, k, from_ns, to_ns, weight);
      const double share = std::abs(weight);
      const double with_previous = previous_weight * (1. - share) + (weight < 0. ? share : 0.);
      add_piece(piece, dt, {(1. - share) * (1. - share) + share * share, with_previous}, out);
      previous_weight = weight > 0. ? share : 0.;
    }
    reached_ns = to_ns;
  }
  return covered && reached_ns >= end_ns && out.samples > 0;
}

void Preintegrator::add_piece(const EncoderSample& y, double dt, PieceNoise noise,
                              PreintegratedPose& out) {
  ++out.samples;
  if (solver_.solve(y, solution_) != Status::kOk) {
    ++out.rejected;
    bridge(dt, nullptr, out);
    return;
  }
  const bool gate = options_.parity_gate_probability > 0.;
  if (gate || options_.parity) {
    const double chi2 = solver_.parity_chi2();
    const int dof = solver_.parity_dof();
    if (gate && dof > 0) {
      if (dof != parity_gate_dof_) {
        parity_gate_dof_ = dof;
        parity_gate_ = chi2_quantile(1. - options_.parity_gate_probability, dof);
      }
      if (!(chi2 <= parity_gate_)) {
        ++out.gated;
        bridge(dt, &solution_.xi, out);
        return;
      }
    }
    // A cut sample appears in two intervals: its parity counts in each by its share of the cell.
    const double cell = seconds_between(y.begin_ns, y.end_ns);
    if (options_.parity && dof > 0)
      solver_.add_parity(cell > 0. ? std::min(dt / cell, 1.) : 1., out.parity);
  }
  if (solution_.rank_deficient) ++out.rank_deficient;
  step(solution_, dt, noise, out);
  std::swap(believed_, solution_);
  has_believed_ = true;
}

void Preintegrator::bridge(double dt, const Twist* unbelieved, PreintegratedPose& out) {
  out.bridged_s += dt;
  if (!has_believed_) {
    // Nothing to bridge from yet: take what there is rather than stand still.
    if (unbelieved != nullptr) step(solution_, dt, {}, out);
    return;
  }
  TwistSolution held = believed_;
  if (unbelieved != nullptr) {
    // The truth lies somewhere between the twist before and the one not believed.
    const Eigen::Vector3d difference = *unbelieved - believed_.xi;
    held.P_xi += difference * difference.transpose();
  }
  step(held, dt, {}, out);
}

void Preintegrator::step(const TwistSolution& solution, double dt, PieceNoise noise,
                         PreintegratedPose& out) {
  const double omega = solution.xi[2];
  const double z = 0.5 * omega * dt;
  const Sinc s = sinc(z);
  const double rho = dt * s.value;                        // (W-6): 2/omega sin(omega dt/2)
  const double rho_prime = 0.5 * dt * dt * s.derivative;  // d rho / d omega
  const double theta_m = out.g[0] + z;
  const double c = std::cos(theta_m);
  const double n = std::sin(theta_m);
  const double vx = c * solution.xi[0] - n * solution.xi[1];  // velocity at mid-interval heading
  const double vy = n * solution.xi[0] + c * solution.xi[1];
  const double dx = rho * vx;
  const double dy = rho * vy;

  // (W-7): columns [v_x, v_y, omega]; rows theta, x, y.
  Eigen::Matrix3d gain;
  gain << 0., 0., dt, rho * c, -rho * n, rho_prime * vx - 0.5 * dt * dy, rho * n, rho * c,
      rho_prime * vy + 0.5 * dt * dx;

  const int n_x = static_cast<int>(out.J_g_WI.cols());
  double* J_theta = out.J_g_WI.data();
  double* J_x = J_theta + n_x;
  double* J_y = J_x + n_x;
  const double* Jv = solution.J_xi_WI.data();
  for (int k = 0; k < n_x; ++k) {
    const double a = Jv[k], b = Jv[n_x + k], w = Jv[2 * n_x + k];
    J_x[k] += -dy * J_theta[k] + gain(1, 0) * a + gain(1, 1) * b + gain(1, 2) * w;
    J_y[k] += dx * J_theta[k] + gain(2, 0) * a + gain(2, 1) * b + gain(2, 2) * w;
    J_theta[k] += dt * w;
  }

  // P <- F P F^T + G Q G^T with F = I + [0; J [dx dy]^T] e_1^T, plus the cross terms of a piece
  // that shares a reading with the one before.
  Eigen::Matrix3d& P = out.P_g;
  P.row(1) -= dy * P.row(0);
  P.row(2) += dx * P.row(0);
  P.col(1) -= dy * P.col(0);
  P.col(2) += dx * P.col(0);
  const Eigen::Matrix3d GQ = gain * solution.P_xi;
  P.noalias() += noise.variance * GQ * gain.transpose();
  if (noise.with_previous != 0.) {
    Eigen::Matrix3d carried = last_gain_;
    carried.row(1) -= dy * last_gain_.row(0);
    carried.row(2) += dx * last_gain_.row(0);
    const Eigen::Matrix3d cross = noise.with_previous * carried * GQ.transpose();
    P += cross + cross.transpose();
  }
  last_gain_ = gain;

  out.g[0] += omega * dt;
  out.g[1] += dx;
  out.g[2] += dy;
  out.duration_s += dt;
  out.path_length_m += dt * std::hypot(solution.xi[0], solution.xi[1]);
}

}  // namespace viwo
