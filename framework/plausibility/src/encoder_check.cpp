#include "encoder_check.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Eigenvalues>

#include "viwo/math/significant.hpp"
#include "viwo/math/time_text.hpp"

namespace viwo {

namespace {

/// No base goes so fast.
constexpr double kImpossible_m_per_s = 60.;

/// Symmetric; of what is held, too.
IntrinsicMatrix root_of(const Eigen::MatrixXd& P) {
  if (P.size() == 0) return {};
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(P);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.).cwiseSqrt().asDiagonal() *
         eigen.eigenvectors().transpose();
}

}  // namespace

EncoderCheck::EncoderCheck(const SensorName& wheels, const WheelSet& set)
    : name_(wheels.text),
      sensor_(wheels.sensor),
      solver_(set.model, {}),
      n_steer_(set.model->description().n_steer),
      trial_(set.model, set.prior.wheels.x_WI, channel_changes(set.model->description())),
      parity_(set.model) {
  solver_.set_intrinsics(set.prior.wheels.x_WI);
  const Eigen::Index n = set.prior.wheels.x_WI.size();
  prior_root_ = root_of(set.P_before().topLeftCorner(n, n));
  drives_.resize(static_cast<std::size_t>(set.model->description().n_drive));
}

std::optional<Twist> EncoderCheck::add(const EncoderSample& sample) {
  if (sample.fault() != nullptr) return {};
  watch_steering(sample);
  for (std::size_t i = 0; i < drives_.size(); ++i) {
    constexpr double kTurns =
        1e-3;  // rad/s: wheels that stand read zero, or next to it, all the time
    const double rate = sample.drive_rad_per_s[i];
    drives_[i].add(rate, sample.t_ns, std::abs(rate) > kTurns);
  }
  last_ = sample;
  // They cost as many solutions as there are changes.
  constexpr std::int64_t kEvery = 5;
  if (samples_++ % kEvery == 0) trial_.add(sample);
  const bool is_solved = solver_.solve(sample, solution_) == Status::kOk;
  if (solver_.model().n_rows() > 3) {
    const bool was_gross =
        parity_.add(sample, solver_.intrinsics(), is_solved ? &solution_ : nullptr);
    if (was_gross && is_solved) add_by_prior(sample);
  }
  if (!is_solved || solution_.rank_deficient) return {};
  const double speed = solution_.xi.head<2>().norm();
  if (speed > kImpossible_m_per_s) {
    if (impossible_++ == 0) first_impossible_ns_ = sample.t_ns;
    fastest_m_per_s_ = std::max(fastest_m_per_s_, speed);
  }
  return solution_.xi;
}

/// What the wheels may contradict each other by, for all that is known of them before.
void EncoderCheck::add_by_prior(const EncoderSample& sample) {
  const Intrinsics x_WI = solver_.intrinsics();
  TwistSolution changed;
  double squares = 0.;
  for (Eigen::Index k = 0; k < prior_root_.cols(); ++k) {
    solver_.set_intrinsics(x_WI + prior_root_.col(k));
    if (solver_.solve(sample, changed) != Status::kOk) continue;
    squares += (changed.e - solution_.e).squaredNorm();
  }
  solver_.set_intrinsics(x_WI);
  by_prior_squares_ += squares / solver_.model().n_rows();
  ++by_prior_count_;
}

void EncoderCheck::watch_steering(const EncoderSample& sample) {
  if (!last_) return;
  const double dt_s = seconds_between(last_->t_ns, sample.t_ns);
  constexpr double kTooFast = 30.;  // rad/s: no wheel is steered like that
  bool is_beyond = false, is_too_fast = false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(n_steer_); ++i) {
    const double angle = std::abs(sample.steer_rad[i]);
    const double change = std::abs(sample.steer_rad[i] - last_->steer_rad[i]);
    is_beyond = is_beyond || angle > 2. * std::numbers::pi;
    is_too_fast = is_too_fast || change > kTooFast * dt_s;
    largest_steer_ = std::max(largest_steer_, angle);
  }
  if (is_beyond) ++beyond_turn_;
  if (is_too_fast) ++too_fast_;
}

void EncoderCheck::findings(std::int64_t zero_ns, Findings& out) const {
  find_stuck(zero_ns, out);
  find_jumps(zero_ns, out);
  const std::size_t before = out.size();
  find_change(out);
  if (out.size() == before) find_degrees(out);
  if (out.size() == before) find_gross(zero_ns, out);
}

void EncoderCheck::find_stuck(std::int64_t zero_ns, Findings& out) const {
  const bool are_all = std::all_of(drives_.begin(), drives_.end(),
                                   [](const StuckChannel& drive) { return drive.was_stuck(); });
  for (std::size_t i = 0; i < drives_.size(); ++i) {
    const StuckChannel& drive = drives_[i];
    if (!drive.was_stuck()) continue;
    const std::string channel = "drive_" + std::to_string(i + 1);
    out.push_back(
        {name_ + " stuck " + channel,
         name_ + ": " + channel + " reads " + significant(drive.value(), 4) +
             " rad/s all the time from " + time_text(drive.from_ns() - zero_ns) + " on, for " +
             significant(seconds_between(drive.from_ns(), drive.to_ns()), 3) + " s: it was stuck" +
             (drive.value() != 0. ? ", or it is an angle or a count (drive_input: angle)" : ""),
         false,
         {},
         are_all});
  }
}

/// Now and then: what is so all the time is a unit.
void EncoderCheck::find_jumps(std::int64_t zero_ns, Findings& out) const {
  if (impossible_ == 0 || 5 * impossible_ > samples_) return;
  out.push_back({name_ + " jumps",
                 name_ + ": " + std::to_string(impossible_) +
                     (impossible_ == 1 ? " sample says" : " samples say") + " that the base goes " +
                     significant(fastest_m_per_s_, 3) + " m/s (the fastest), first at " +
                     time_text(first_impossible_ns_ - zero_ns) +
                     ": a counter or an angle that began anew (drive_turn of tables: where it "
                     "does), or readings that are none"});
}

/// Angles beyond a turn are right where an encoder counts turns, but not so fast.
void EncoderCheck::find_degrees(Findings& out) const {
  if (samples_ < 100 || 10 * beyond_turn_ < samples_ || 100 * too_fast_ < samples_) return;
  out.push_back({name_ + " steering",
                 name_ + ": steering angles up to " + significant(largest_steer_, 3) +
                     " rad: they are in degrees",
                 false,
                 ChannelChange{ChannelChange::kSteerUnit, 0, 0, std::numbers::pi / 180.}.remedies(
                     sensor_, solver_.model().description())});
}

/// Wheels that slip contradict the others now and then; what is wired, counted or written wrongly
/// does for good.
void EncoderCheck::find_gross(std::int64_t zero_ns, Findings& out) const {
  constexpr double kLeast_s = 4., kMostPart = 0.5;  // of the driving
  const double gross_s = parity_.gross_s();
  if (gross_s < kLeast_s || gross_s <= kMostPart * parity_.driven_s()) return;
  const Parity parity = parity_.gross();
  // Wheels that a filter is to find are as their prior allows when they contradict each other.
  const double by_prior = std::sqrt(by_prior_squares_ / std::max(1., by_prior_count_));
  out.push_back({name_ + " parity",
                 name_ + ": the wheels contradict each other grossly (rms " +
                     significant(parity.rms, 2) + " m/s at " + significant(parity.speed, 2) +
                     " m/s) for " + significant(gross_s, 3) + " of the " +
                     significant(parity_.driven_s(), 3) + " s that it drives, first at " +
                     time_text(parity_.first_gross_ns() - zero_ns) +
                     ": a drive or a steering that is not read, order or signs of the channels, "
                     "zeros or units of the steering (viwo inspect looks for them)",
                 false,
                 {},
                 !(parity.rms < 2. * by_prior)});
}

/// Where several changes explain the contradictions, all of them are named.
void EncoderCheck::find_change(Findings& out) const {
  const std::vector<ChannelChange> changes = trial_.explaining();
  if (changes.empty()) return;
  const bool is_unit = changes[0].kind == ChannelChange::kSteerUnit;
  Finding finding{name_ + (is_unit ? " steering" : " order"), name_ + ": " + text_of(changes)};
  if (changes.size() == 1) {
    finding.remedies = changes[0].remedies(sensor_, solver_.model().description());
  }
  out.push_back(std::move(finding));
}

}  // namespace viwo
