#include "viwo/wheel/preintegration.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "pieces.hpp"
#include "viwo/math/chi2.hpp"
#include "viwo/math/se2.hpp"

namespace viwo {
namespace {

constexpr double kFullTurn = 2. * std::numbers::pi;

/// Readings of `a` moved towards those of `b`: (1 - weight) a + weight b; angles by the shorter way
/// round, for an encoder may begin anew between the two.
EncoderSample blend(const EncoderSample& a, const EncoderSample& b, double weight) {
  EncoderSample mixed = a;
  mixed.bad_drives |= b.bad_drives;
  mixed.bad_steers |= b.bad_steers;
  for (std::size_t i = 0; i < static_cast<std::size_t>(a.n_drive); ++i) {
    mixed.drive_rad_per_s[i] += weight * (b.drive_rad_per_s[i] - a.drive_rad_per_s[i]);
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(a.n_steer); ++i) {
    mixed.steer_rad[i] += weight * std::remainder(b.steer_rad[i] - a.steer_rad[i], kFullTurn);
  }
  return mixed;
}

/// The piece [begin_ns, end_ns] of sample k, read at its middle. Readings change evenly within a
/// cell, as since the cell before: so the pieces of a cell add up to what was counted in it, also
/// when one is asked for before the next sample is known (W-11). Not from a cell that is much
/// shorter: what was counted by stamps of arrival that came in a bunch is no rate of that time.
/// `share`: how much of the sample before is taken off.
EncoderSample cut(std::span<const EncoderSample> samples, std::size_t k, std::int64_t begin_ns,
                  std::int64_t end_ns, double& share) {
  const EncoderSample& sample = samples[k];
  share = 0.;
  if (k == 0 || samples[k - 1].end_ns != sample.begin_ns) return sample;
  // What is not believed of the one before is not to be in this one.
  const EncoderSample& before = samples[k - 1];
  if (2 * (before.end_ns - before.begin_ns) < sample.end_ns - sample.begin_ns) return sample;
  if (before.bad_drives != 0 || before.bad_steers != 0 || before.fault() != nullptr) return sample;
  // Twice the middles.
  const std::int64_t cell = sample.begin_ns + sample.end_ns;
  const std::int64_t cell_before = samples[k - 1].begin_ns + samples[k - 1].end_ns;
  share = seconds_between(cell, begin_ns + end_ns) / seconds_between(cell_before, cell);
  return blend(sample, samples[k - 1], -share);
}

/// P <- Phi_tr P Phi_tr^T (W-7), P symmetric: the yaw moves the end by [-dy, dx].
void carry(double dx, double dy, Eigen::Matrix3d& P) {
  const double tt = P(0, 0), tx = P(0, 1), ty = P(0, 2);
  P(0, 1) = P(1, 0) = tx - dy * tt;
  P(0, 2) = P(2, 0) = ty + dx * tt;
  P(1, 1) -= dy * (tx + P(0, 1));
  P(2, 2) += dx * (ty + P(0, 2));
  P(1, 2) = P(2, 1) = P(1, 2) - dy * ty + dx * P(0, 1);
}

/// J_g <- Phi_tr J_g + Phi_xi J_xi (W-7).
void carry_jacobian(double dx, double dy, const Eigen::Matrix3d& Phi_xi,
                    const IntrinsicJacobian& J_xi, IntrinsicJacobian& J_g) {
  in_pieces(static_cast<int>(J_g.cols()), [&](int first, auto width) {
    constexpr int kWidth = decltype(width)::value;
    using Piece = Eigen::Matrix<double, 1, kWidth>;
    const Piece v_x = J_xi.row(0).segment<kWidth>(first);
    const Piece v_y = J_xi.row(1).segment<kWidth>(first);
    const Piece omega = J_xi.row(2).segment<kWidth>(first);
    const Piece theta = J_g.row(0).segment<kWidth>(first);
    J_g.row(0).segment<kWidth>(first) += Phi_xi(0, 2) * omega;
    J_g.row(1).segment<kWidth>(first) +=
        Phi_xi(1, 0) * v_x + Phi_xi(1, 1) * v_y + Phi_xi(1, 2) * omega - dy * theta;
    J_g.row(2).segment<kWidth>(first) +=
        Phi_xi(2, 0) * v_x + Phi_xi(2, 1) * v_y + Phi_xi(2, 2) * omega + dx * theta;
  });
}

/// P <- P + variance G Q G^T, all symmetric but G.
void add_noise(const Eigen::Matrix3d& G, const Eigen::Matrix3d& Q, double variance,
               Eigen::Matrix3d& P) {
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d GQ = variance * (Q * G.row(i).transpose());
    for (int j = 0; j <= i; ++j) {
      P(i, j) += GQ.dot(G.row(j));
      P(j, i) = P(i, j);
    }
  }
}

}  // namespace

void PreintegratedPose::reset(int n_intrinsics) {
  g.setZero();
  J_g_WI.setZero(3, n_intrinsics);
  P_g.setZero();
  duration_s = path_length_m = bridged_s = 0.;
  samples = gated = rejected = rank_deficient = 0;
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
  total.parity.of_noise += next.parity.of_noise;
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
    : options_(options), solver_(std::move(model), options.twist) {}

bool Preintegrator::integrate(std::span<const EncoderSample> samples, std::int64_t begin_ns,
                              std::int64_t end_ns, PreintegratedPose& out) {
  out.reset(solver_.model().n_intrinsics());
  parity_samples_ = 0.;
  begin_at(begin_ns);
  const auto after_begin = [&](const EncoderSample& sample) { return sample.end_ns <= begin_ns; };
  const auto first = std::partition_point(samples.begin(), samples.end(), after_begin);
  find_motion(samples.subspan(static_cast<std::size_t>(first - samples.begin())), end_ns);
  std::int64_t reached_ns = begin_ns;
  bool covered = true;
  double previous_own = 0.;  // how much of its own sample went into the piece before
  // A hole between cells: the mean of its neighbours, a piece of its own.
  const auto bridge_hole = [&](std::size_t next, std::int64_t until_ns) {
    const double dt = seconds_between(reached_ns, until_ns);
    const double bridged_s = out.bridged_s;
    // Its parity says nothing that those do not.
    add_piece(blend(samples[next - 1], samples[next], 0.5), dt, {.parity = 0., .samples = 0}, out);
    out.bridged_s = bridged_s + dt;
    previous_own = 0.;
    reached_ns = until_ns;
  };
  auto k = static_cast<std::size_t>(first - samples.begin());
  for (; k < samples.size() && samples[k].begin_ns < end_ns; ++k) {
    const EncoderSample& sample = samples[k];
    if (sample.begin_ns > reached_ns) {
      if (k > 0) {
        bridge_hole(k, sample.begin_ns);
      } else {
        covered = false;
      }
    }
    const std::int64_t from_ns = std::max(sample.begin_ns, begin_ns);
    const std::int64_t to_ns = std::min(sample.end_ns, end_ns);
    const double dt = seconds_between(from_ns, to_ns);
    if (from_ns == sample.begin_ns && to_ns == sample.end_ns) {
      add_piece(sample, dt, {}, out);
      previous_own = 1.;
    } else {
      double share = 0.;
      const EncoderSample piece = cut(samples, k, from_ns, to_ns, share);
      const double own = 1. + share;
      const double variance = own * own + share * share;
      // It counts in each of its intervals by its part of the cell.
      const double cell = seconds_between(sample.begin_ns, sample.end_ns);
      // It counts as a sample where its stamp is.
      const int counts = sample.t_ns >= from_ns && sample.t_ns < to_ns ? 1 : 0;
      add_piece(piece, dt, {variance, -share * previous_own, dt / cell, counts}, out);
      previous_own = own;
    }
    reached_ns = to_ns;
  }
  if (reached_ns < end_ns && k > 0 && k < samples.size()) bridge_hole(k, end_ns);
  out.parity.of_noise *= parity_samples_;
  reached_ns_ = reached_ns;
  return covered && reached_ns >= end_ns;
}

/// What has been believed up to there.
void Preintegrator::begin_at(std::int64_t begin_ns) {
  owed_s_ = 0.;
  if (begin_ns == begun_ns_) {
    has_believed_ = has_believed_there_;
    if (has_believed_) solutions_[believed_] = believed_there_;
    return;
  }
  if (begin_ns != reached_ns_) has_believed_ = false;
  begun_ns_ = begin_ns;
  has_believed_there_ = has_believed_;
  if (has_believed_) believed_there_ = solutions_[believed_];
}

/// (W-16): whether the mean of the samples before end_ns shows a motion.
void Preintegrator::find_motion(std::span<const EncoderSample> samples, std::int64_t end_ns) {
  const double sigmas = options_.twist.motion_sigmas;
  if (sigmas <= 0.) return;
  bool moves = false;
  const auto end = std::find_if(samples.begin(), samples.end(),
                                [end_ns](const EncoderSample& y) { return y.begin_ns >= end_ns; });
  if (end != samples.begin()) {
    EncoderSample mean = samples.front();
    double n = 0.;
    for (auto y = samples.begin(); y != end; ++y) mean = blend(mean, *y, 1. / ++n);
    TwistSolution& solution = solutions_[1 - believed_];
    if (solver_.solve(mean, solution) == Status::kOk) {
      for (int i = 0; i < 3; ++i) {
        moves |= !is_noise(solution.xi[i], solution.P_xi(i, i) / n, sigmas);
      }
    }
  }
  solver_.set_moving(moves);
}

void Preintegrator::add_piece(const EncoderSample& y, double dt, PieceNoise noise,
                              PreintegratedPose& out) {
  out.samples += noise.samples;
  TwistSolution& solution = solutions_[1 - believed_];
  if (solver_.solve(y, solution) != Status::kOk) {
    out.rejected += noise.samples;
    bridge(dt, nullptr, out);
    return;
  }
  const bool gate = options_.parity_gate_probability > 0.;
  if (gate || options_.parity) {
    const TwistSolver::Parity parity = solver_.parity();
    const int dof = parity.dof();
    if (gate && dof > 0) {
      if (dof != parity_gate_dof_) {
        parity_gate_dof_ = dof;
        parity_gate_ = chi2_quantile(1. - options_.parity_gate_probability, dof);
      }
      if (!(parity.chi2() <= noise.variance * parity_gate_)) {
        out.gated += noise.samples;
        bridge(dt, &solution, out);
        return;
      }
    }
    if (options_.parity && dof > 0 && noise.parity > 0.) {
      // One sample stands for all: where it matters the motion is much the same all the time.
      if (parity_samples_ == 0.) solver_.add_parity_of_noise(parity, out.parity);
      parity_samples_ += noise.parity;
      solver_.add_parity(parity, noise.parity, out.parity);
      // What is seen of a cut sample is as noisy as its piece; what it tells is told once.
      out.parity.dof += noise.parity * (noise.variance - 1.) * dof;
    }
  }
  if (solution.rank_deficient) out.rank_deficient += noise.samples;
  if (owed_s_ > 0.) step(solution, std::exchange(owed_s_, 0.), {}, out);
  step(solution, dt, noise, out);
  believed_ = 1 - believed_;  // solution becomes the one believed last
  has_believed_ = true;
}

void Preintegrator::bridge(double dt, const TwistSolution* unbelieved, PreintegratedPose& out) {
  out.bridged_s += dt;
  if (!has_believed_) {
    // Nothing to bridge from yet: take what there is rather than stand still, or what comes.
    if (unbelieved != nullptr) {
      step(*unbelieved, std::exchange(owed_s_, 0.) + dt, {}, out);
    } else {
      owed_s_ += dt;
    }
    return;
  }
  TwistSolution held = solutions_[believed_];
  if (unbelieved != nullptr) {
    // The truth lies somewhere between the twist before and the one not believed.
    const Eigen::Vector3d difference = unbelieved->xi - held.xi;
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

  carry_jacobian(dx, dy, gain, solution.J_xi_WI, out.J_g_WI);
  carry(dx, dy, out.P_g);
  add_noise(gain, solution.P_xi, noise.variance, out.P_g);
  if (noise.with_previous != 0.) {
    // The piece shares a reading with the one before.
    Eigen::Matrix3d carried = last_gain_;
    carried.row(1) -= dy * last_gain_.row(0);
    carried.row(2) += dx * last_gain_.row(0);
    const Eigen::Matrix3d cross = noise.with_previous * carried * solution.P_xi * gain.transpose();
    out.P_g += cross + cross.transpose();
  }
  last_gain_ = gain;

  out.g[0] += omega * dt;
  out.g[1] += dx;
  out.g[2] += dy;
  out.duration_s += dt;
  out.path_length_m += dt * std::sqrt(vx * vx + vy * vy);
}

}  // namespace viwo
