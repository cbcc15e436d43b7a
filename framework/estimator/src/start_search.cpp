#include "viwo/estimator/start_search.hpp"

#include <algorithm>

namespace viwo {
namespace {

/// Between two attempts: one may take longer than the IMU to its next sample.
constexpr std::int64_t kPeriodNs = 50'000'000;

}  // namespace

bool StartSearch::is_due(std::span<const ImuSample> imu, bool finished) {
  if (!initializer_) return false;
  if (finished) return !std::exchange(attempted_at_end_, true);
  if (imu.empty() || imu.back().t_ns < next_ns_) return false;
  next_ns_ = imu.back().t_ns + kPeriodNs;
  return true;
}

std::optional<ImuPrior> StartSearch::attempt(const StartData& data) {
  const StartAttempt found = initializer_(data);
  if (found.prior) return found.prior;
  const auto is_known = [&](const StartObstacle& known) { return known.text == found.obstacle; };
  auto known = std::find_if(obstacles_.begin(), obstacles_.end(), is_known);
  if (known == obstacles_.end()) known = obstacles_.insert(known, {found.obstacle, 0});
  ++known->count;
  return std::nullopt;
}

}  // namespace viwo
