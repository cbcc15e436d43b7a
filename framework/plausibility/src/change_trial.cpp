#include "viwo/plausibility/change_trial.hpp"

#include <algorithm>
#include <utility>

namespace viwo {

ChangeTrial::ChangeTrial(const std::shared_ptr<const WheelModel>& model, const Intrinsics& x_WI,
                         std::vector<ChannelChange> changes)
    : solver_(model, {}) {
  solver_.set_intrinsics(x_WI);
  for (ChannelChange& change : changes) changes_.push_back({change});
  no_steering_.change.kind = ChannelChange::kNoSteering;
}

bool ChangeTrial::add_to(Tried& tried, const EncoderSample& sample) {
  EncoderSample changed = sample;
  tried.change.undo(changed);
  if (solver_.solve(changed, solution_) != Status::kOk || solution_.rank_deficient) return false;
  tried.residual += solution_.e.squaredNorm();
  return true;
}

void ChangeTrial::add(const EncoderSample& sample) {
  if (solver_.model().n_rows() <= 3) return;
  for (Tried& tried : changes_) {
    if (!add_to(tried, sample)) return;
    if (&tried == &changes_.front()) signal_ += solution_.xi.head<2>().squaredNorm();
  }
  if (solver_.model().description().n_steer > 0 && !add_to(no_steering_, sample)) return;
  ++tried_;
}

std::vector<ChannelChange> ChangeTrial::explaining() const {
  constexpr std::int64_t kFewest = 50;
  constexpr double kLeast_m_per_s = 0.01, kLeastPart = 0.01, kMostLeft = 0.1, kAsWell = 3.;
  const auto best = std::ranges::min_element(changes_, {}, &Tried::residual);
  if (tried_ < kFewest || best == changes_.begin()) return {};
  const double rows = solver_.model().n_rows() * static_cast<double>(tried_);
  const double none = changes_.front().residual;
  if (none < rows * kLeast_m_per_s * kLeast_m_per_s || none < kLeastPart * signal_) return {};
  // Degrees are next to nothing: where no steering at all explains it, the unit cannot be told.
  const double as_well = kAsWell * best->residual;
  const bool is_degrees = best->change.kind == ChannelChange::kSteersInDegrees;
  if (is_degrees && no_steering_.residual < as_well) return {};
  std::vector<ChannelChange> found = {best->change};
  for (const Tried& other : changes_) {
    const bool is_best = &other == &*best;
    if (other.residual >= as_well && !is_best) continue;
    if (other.residual >= kMostLeft * none) return {};
    if (!is_best) found.push_back(other.change);
  }
  return found;
}

}  // namespace viwo
