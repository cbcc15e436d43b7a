#include "viwo/plausibility/change_trial.hpp"

#include <algorithm>
#include <utility>

namespace viwo {

ChangeTrial::ChangeTrial(const std::shared_ptr<const WheelModel>& model, const Intrinsics& x_WI,
                         const std::vector<ChannelChange>& changes)
    : solver_(model, {}) {
  solver_.set_intrinsics(x_WI);
  for (const ChannelChange& change : changes) changes_.push_back({change});
  no_steering_.change.kind = ChannelChange::kNoSteering;
}

bool ChangeTrial::solves(Tried& tried, const EncoderSample& sample) {
  EncoderSample changed = sample;
  tried.change.undo(changed);
  if (solver_.solve(changed, solution_) != Status::kOk) return false;
  tried.of_sample = solution_.e.squaredNorm();
  return true;
}

void ChangeTrial::add(const EncoderSample& sample) {
  if (solver_.model().n_rows() <= 3) return;
  // Rows that a change makes tell less than the twist contradict each other all the same.
  if (!solves(changes_.front(), sample) || solution_.rank_deficient) return;
  const double signal = solution_.xi.head<2>().squaredNorm();
  const bool all_well = std::all_of(changes_.begin() + 1, changes_.end(),
                                    [&](Tried& tried) { return solves(tried, sample); });
  if (!all_well || !solves(no_steering_, sample)) return;
  signal_ += signal;
  for (Tried& tried : changes_) tried.residual += tried.of_sample;
  no_steering_.residual += no_steering_.of_sample;
  ++tried_;
}

/// Where no steering at all explains it as well, the unit of angles that are next to nothing cannot
/// be told.
bool ChangeTrial::is_next_to_none(const Tried& tried) const {
  return tried.change.kind == ChannelChange::kSteerUnit && tried.change.scale < 1. &&
         no_steering_.residual < kAsWell * tried.residual;
}

std::vector<ChannelChange> ChangeTrial::explaining() const {
  constexpr std::int64_t kFewest = 50;
  constexpr double kLeast_m_per_s = 0.001, kLeastPart = 0.01, kMostLeft = 0.1;
  const double rows = solver_.model().n_rows() * static_cast<double>(tried_);
  const double none = changes_.front().residual;
  if (tried_ < kFewest || none < rows * kLeast_m_per_s * kLeast_m_per_s ||
      none < kLeastPart * signal_) {
    return {};
  }
  std::vector<Tried> told = changes_;
  std::erase_if(told, [this](const Tried& tried) { return is_next_to_none(tried); });
  std::ranges::stable_sort(told, {}, &Tried::residual);
  std::vector<ChannelChange> found;
  for (const Tried& tried : told) {
    if (!found.empty() && tried.residual >= kAsWell * told.front().residual) break;
    if (tried.residual >= kMostLeft * none) return {};
    found.push_back(tried.change);
  }
  return found;
}

}  // namespace viwo
