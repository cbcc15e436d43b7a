#include "viwo/wheel/wheel_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <Eigen/LU>

#include "viwo/math/chi2.hpp"
#include "viwo/math/time_text.hpp"

namespace viwo {
namespace {

/// Parity noise that is a hundred times that of the encoders is not unheard of.
constexpr double kMostNoise = 100.;
constexpr double kBelievedSamples = 50.;
constexpr double kRememberedSamples = 500.;
/// A wheel lies if without it the rest agrees this much better than without any other one.
constexpr double kClearly = 4.;
/// Wheels of one sample.
constexpr int kMostLiars = 2;
/// Nothing turns so fast. Of a reading beyond it, a spike of a bus, the noise of the steering would
/// leave nothing but rounding: it is judged as if it were this.
constexpr double kFastest_rad_per_s = 1e6;

TwistOptions options() {
  TwistOptions options;
  options.noise_weighted = true;
  options.fitted_jacobian = true;
  return options;
}

EncoderSample within_measure(EncoderSample y) {
  for (double& drive : y.drive_rad_per_s) {
    drive = std::clamp(drive, -kFastest_rad_per_s, kFastest_rad_per_s);
  }
  return y;
}

bool are_same(RowRange a, RowRange b) { return a.first == b.first && a.count == b.count; }

void mark(NoiseKind kind, int channel, EncoderSample& y) {
  (kind == NoiseKind::kDrive ? y.bad_drives : y.bad_steers) |= 1u << static_cast<unsigned>(channel);
}

}  // namespace

WheelCheck::WheelCheck(std::shared_ptr<const WheelModel> model, double probability)
    : solver_(std::move(model), options()),
      noise_(kBelievedSamples, kRememberedSamples, kMostNoise) {
  const WheelModel& wheels = solver_.model();
  const std::vector<NoiseSpec>& noises = wheels.description().noises;
  for (int k = 0; k < wheels.n_noises(); ++k) {
    const NoiseSpec& noise = noises[static_cast<std::size_t>(k)];
    if (noise.kind == NoiseKind::kSlip) continue;
    suspects_.push_back({noise.kind, noise.channel, noise.rows});
  }
  // Fewer rows cannot tell who lies.
  const int most_dof = wheels.n_rows() - 3;
  if (probability > 0. && most_dof > 1) {
    gates_.push_back(0.);
    for (int dof = 1; dof <= most_dof; ++dof) {
      gates_.push_back(chi2_quantile(1. - probability, dof));
    }
  }
  P_.setZero(wheels.n_intrinsics(), wheels.n_intrinsics());
}

void WheelCheck::set_calibration(const Intrinsics& x_WI, const IntrinsicMatrix& P) {
  solver_.set_intrinsics(x_WI);
  P_ = P;
}

/// (W-12): of the parity residual, under the noise found and what the calibration may be off by.
WheelCheck::Verdict WheelCheck::judge(const EncoderSample& y) {
  if (solver_.solve(y, solution_) != Status::kOk || solution_.rank_deficient) return {};
  const double variance = noise_.variance();
  // Of readings beyond all measure rounding takes the sign.
  const TwistSolver::Parity residual = solver_.parity();
  Verdict verdict{std::abs(residual.chi2()) / variance, residual.dof()};
  if (verdict.dof < 1 || verdict.chi2 <= gate(verdict.dof)) return verdict;
  parity_.reset(static_cast<int>(P_.rows()));
  solver_.add_parity(residual, 1. / variance, parity_);
  IntrinsicMatrix M = parity_.Lambda * P_;
  M.diagonal().array() += 1.;
  const Intrinsics explained = P_ * M.partialPivLu().solve(parity_.eta);
  verdict.chi2 -= std::max(0., parity_.eta.dot(explained));
  return verdict;
}

bool WheelCheck::agrees(const Verdict& verdict) const {
  return verdict.dof > 0 && verdict.chi2 <= gate(verdict.dof);
}

/// (W-13): the suspect without which the rest agrees, and that clearly better than without any
/// other wheel; null if there is none.
WheelCheck::Suspect* WheelCheck::least_agreeable(const EncoderSample& y, int least_dof,
                                                 Verdict& without) {
  Suspect* best = nullptr;
  double second = std::numeric_limits<double>::infinity();
  for (Suspect& suspect : suspects_) {
    EncoderSample rest = y;
    mark(suspect.kind, suspect.channel, rest);
    const Verdict verdict = judge(rest);
    if (verdict.dof < least_dof) continue;
    if (best == nullptr || verdict.chi2 < without.chi2) {
      if (best != nullptr) second = without.chi2;
      best = &suspect;
      without = verdict;
    } else if (verdict.chi2 > without.chi2) {  // the same: another channel of the same wheel
      second = std::min(second, verdict.chi2);
    }
  }
  return best != nullptr && second > kClearly * without.chi2 ? best : nullptr;
}

/// The steering or the drive of the suspect's wheel, whichever is farther from where the others
/// want it: as parts of the wheel's velocity, along it and across.
WheelCheck::Suspect* WheelCheck::of_same_wheel(const EncoderSample& rest, Suspect& suspect) {
  judge(rest);
  EncoderSample wanted = rest;
  const WheelModel& model = solver_.model();
  const RowVector no_slip = RowVector::Zero(model.n_rows());
  if (model.model().inverse(solution_.xi, solver_.intrinsics(), no_slip, wanted) != Status::kOk) {
    return &suspect;
  }
  Suspect* drive = nullptr;
  Suspect* steering = nullptr;
  for (Suspect& other : suspects_) {
    if (!are_same(other.rows, suspect.rows)) continue;
    (other.kind == NoiseKind::kDrive ? drive : steering) = &other;
  }
  if (drive == nullptr || steering == nullptr) return &suspect;
  const auto i = static_cast<std::size_t>(drive->channel);
  const auto k = static_cast<std::size_t>(steering->channel);
  const double across = wanted.drive_rad_per_s[i] *
                        std::remainder(wanted.steer_rad[k] - rest.steer_rad[k], 2. * M_PI);
  const double along = wanted.drive_rad_per_s[i] - rest.drive_rad_per_s[i];
  return std::abs(across) > std::abs(along) ? steering : drive;
}

void WheelCheck::check(EncoderSample& y) {
  if (gates_.empty()) return;
  ++samples_;
  EncoderSample rest = within_measure(y);
  Verdict verdict = judge(rest);
  if (verdict.dof < 1) return;
  const Suspect* const liar_before = std::exchange(liar_, nullptr);
  const bool nobody_before = std::exchange(is_nobody_, false);
  if (agrees(verdict)) {
    noise_.add(noise_.variance() * verdict.chi2 / verdict.dof);
    return;
  }
  const int dof = verdict.dof;
  std::array<Suspect*, kMostLiars> liars{};
  std::size_t n_liars = 0;
  while (!agrees(verdict) && n_liars < liars.size()) {
    // One contradiction that is left may be small by chance: enough to name one wheel, not two.
    Suspect* const liar = least_agreeable(rest, 1 + static_cast<int>(n_liars), verdict);
    if (liar == nullptr) break;
    mark(liar->kind, liar->channel, rest);
    liars[n_liars++] = of_same_wheel(rest, *liar);
  }
  const bool is_explained = agrees(verdict);
  if (is_explained) liar_ = liars[0];
  if (is_explained && liar_ == liar_before) {
    noise_.add(noise_.variance() * verdict.chi2 / verdict.dof);
  } else {
    // Who lies goes on to: now this wheel and now that one is noise.
    noise_.add_beyond(gate(dof) / dof);
  }
  if (!is_explained) {
    if (contradicting_++ == 0) first_contradicting_ns_ = y.t_ns;
    is_nobody_ = true;
    // Alone it is an outlier; two in a row are the noise, or the calibration.
    if (nobody_before) return;
    for (const Suspect& suspect : suspects_) mark(suspect.kind, suspect.channel, y);
    return;
  }
  for (std::size_t i = 0; i < n_liars; ++i) {
    mark(liars[i]->kind, liars[i]->channel, y);
    if (liars[i]->left_out++ == 0) liars[i]->first_ns = y.t_ns;
    liars[i]->last_ns = y.t_ns;
  }
}

void WheelCheck::rejections(std::vector<RejectionCount>& out) const {
  for (const Suspect& suspect : suspects_) {
    if (suspect.left_out == 0) continue;
    const char* kind = suspect.kind == NoiseKind::kDrive ? "drive " : "steering ";
    out.push_back({kind + std::to_string(suspect.channel + 1) +
                       " left out of a sample: the other wheels contradict it (its cable, sign, "
                       "unit, or the order of the joints)",
                   suspect.left_out,
                   time_text(suspect.first_ns) + " .. " + time_text(suspect.last_ns), samples_});
  }
  if (contradicting_ > 0) {
    out.push_back(
        {"sample whose wheels contradict each other, none of them in particular (left "
         "out where the one before is not such)",
         contradicting_, time_text(first_contradicting_ns_), samples_});
  }
}

}  // namespace viwo
