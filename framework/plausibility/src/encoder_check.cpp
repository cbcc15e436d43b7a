#include "encoder_check.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "viwo/math/significant.hpp"

namespace viwo {

EncoderCheck::EncoderCheck(std::string name, std::shared_ptr<const WheelModel> model,
                           const WheelsPrior& prior)
    : name_(std::move(name)), solver_(model, {}), n_steer_(model->description().n_steer) {
  solver_.set_intrinsics(prior.wheels.x_WI);
  const auto channels = [](int n, Change::Kind sign, Change::Kind exchanged,
                           std::vector<Change>& out) {
    for (std::size_t a = 0; a < static_cast<std::size_t>(n); ++a) {
      out.push_back({sign, a, a});
      for (std::size_t b = a + 1; b < static_cast<std::size_t>(n); ++b) {
        out.push_back({exchanged, a, b});
      }
    }
  };
  changes_.push_back({});
  channels(model->description().n_drive, Change::kDriveSign, Change::kDrivesExchanged, changes_);
  channels(n_steer_, Change::kSteerSign, Change::kSteersExchanged, changes_);
  if (n_steer_ > 1) changes_.push_back({Change::kSteerSigns});
}

void EncoderCheck::Change::undo(EncoderSample& sample) const {
  switch (kind) {
    case kNone:
      break;
    case kDriveSign:
      sample.drive_rad_per_s[a] *= -1.;
      break;
    case kDrivesExchanged:
      std::swap(sample.drive_rad_per_s[a], sample.drive_rad_per_s[b]);
      break;
    case kSteerSign:
      sample.steer_rad[a] *= -1.;
      break;
    case kSteersExchanged:
      std::swap(sample.steer_rad[a], sample.steer_rad[b]);
      break;
    case kSteerSigns:
      for (double& angle : sample.steer_rad) angle *= -1.;
      break;
  }
}

std::string EncoderCheck::Change::text() const {
  const std::string first = std::to_string(a + 1), second = std::to_string(b + 1);
  switch (kind) {
    case kNone:
      break;
    case kDriveSign:
      return "drive_" + first + " turns opposite to what the other wheels say: its sign";
    case kDrivesExchanged:
      return "drives contradict each other, and do not with drive_" + first + " and drive_" +
             second + " exchanged: their order";
    case kSteerSign:
      return "steer_" + first + " turns opposite to what the other wheels say: its sign";
    case kSteersExchanged:
      return "wheels contradict each other, and do not with steer_" + first + " and steer_" +
             second + " exchanged: their order";
    case kSteerSigns:
      return "wheels contradict each other, and do not with all steering angles reversed: their "
             "sign, or left and right of the wheels are exchanged";
  }
  return "";
}

std::optional<Twist> EncoderCheck::add(const EncoderSample& sample) {
  if (sample.fault() != nullptr) return {};
  watch_steering(sample);
  last_ = sample;
  // They cost as many solutions as there are changes.
  constexpr std::int64_t kEvery = 5;
  if (samples_++ % kEvery == 0) try_changes(sample);
  if (solver_.solve(sample, solution_) != Status::kOk || solution_.rank_deficient) return {};
  return solution_.xi;
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

void EncoderCheck::try_changes(const EncoderSample& sample) {
  if (solver_.model().n_rows() <= 3) return;  // nothing can contradict anything
  for (Change& change : changes_) {
    EncoderSample changed = sample;
    change.undo(changed);
    if (solver_.solve(changed, solution_) != Status::kOk || solution_.rank_deficient) return;
    change.residual += solution_.e.squaredNorm();
    change.signal += solution_.xi.head<2>().squaredNorm();
  }
  ++tried_;
}

void EncoderCheck::findings(Findings& out) const {
  const std::size_t before = out.size();
  find_degrees(out);
  if (out.size() == before) find_change(out);
}

/// Angles beyond a turn are right where an encoder counts turns, but not so fast.
void EncoderCheck::find_degrees(Findings& out) const {
  if (samples_ < 100 || 10 * beyond_turn_ < samples_ || 100 * too_fast_ < samples_) return;
  out.push_back({name_ + " steering", name_ + ": steering angles up to " +
                                          significant(largest_steer_, 3) +
                                          " rad: they are in degrees"});
}

/// One change, and no other, makes the contradictions of the wheels vanish: to a tenth of what they
/// are, and a third of what is left by the next best.
void EncoderCheck::find_change(Findings& out) const {
  if (tried_ < 50) return;
  const auto best =
      std::min_element(changes_.begin(), changes_.end(),
                       [](const Change& a, const Change& b) { return a.residual < b.residual; });
  if (best == changes_.begin()) return;
  const double n_rows = solver_.model().n_rows();
  const double least = 1e-4 * n_rows * static_cast<double>(tried_);  // 1 cm/s each
  const Change& none = changes_.front();
  if (none.residual < least || none.residual < 0.01 * none.signal) return;
  for (const Change& other : changes_) {
    if (&other != &*best && other.residual < 3. * best->residual) return;
  }
  if (best->residual < 0.1 * none.residual)
    out.push_back({name_ + " order", name_ + ": " + best->text()});
}

}  // namespace viwo
