// How the estimator comes to a start, and what becomes of the measurements before it.
#include <algorithm>
#include <cmath>
#include <utility>

#include "viwo/filter/estimator.hpp"

namespace viwo {
namespace {

/// No start looks at more than this before it (estimator.start_window_s has that bound).
constexpr std::int64_t kMaxStartWindowNs = 60'000'000'000;
/// Between two attempts: one may take longer than the IMU to its next sample.
constexpr std::int64_t kAttemptPeriodNs = 50'000'000;

/// Until when a stream from `front_ns` to `newest_ns` is forgotten; nothing as long as moving the
/// rest is not worth while.
std::optional<std::int64_t> forget_until(std::int64_t front_ns, std::int64_t newest_ns) {
  if (newest_ns - front_ns < 2 * kMaxStartWindowNs) return std::nullopt;
  return newest_ns - kMaxStartWindowNs;
}

template <class Sample>
void forget_old(std::vector<Sample>& samples, std::int64_t newest_ns) {
  const auto until_ns = forget_until(samples.front().t_ns, newest_ns);
  if (!until_ns) return;
  const auto keep = std::find_if(samples.begin(), samples.end(),
                                 [&](const Sample& sample) { return sample.t_ns >= *until_ns; });
  samples.erase(samples.begin(), keep);
}

}  // namespace

void Estimator::start(const ImuPrior& prior) {
  filter_.initialize(prior);
  initializer_ = nullptr;
  start_ns_ = prior.t_ns;
  drop_images(prior.t_ns);
  for (PoseStream& stream : poses_) drop_poses(stream, prior.t_ns);
}

void Estimator::drop_images(std::int64_t t_ns) {
  take_images(t_ns);
  for (std::size_t i = 0; i < n_images_; ++i) reject("image before the start", images_[i].t_ns);
}

void Estimator::drop_poses(PoseStream& stream, std::int64_t t_ns) {
  stream.take(t_ns);
  for (const PoseSample& pose : stream.taken) reject("pose before the start", pose.t_ns);
}

void Estimator::forget_before_start() {
  // By the newest stamp of each stream: one that is far in the future spoils no other, and all have
  // an end where the IMU, or another, does not come at all.
  if (!imu_.empty()) forget_old(imu_, imu_.back().t_ns);
  for (std::size_t i = 0; i < encoders_.size(); ++i) {
    if (encoders_[i].empty()) continue;
    std::int64_t newest_ns = encoders_[i].back().t_ns;
    if (!imu_.empty()) {  // what they say when they have stopped must not be in the way for ever
      const std::int64_t t_OtoI_ns = std::llround(1e9 * filter_.wheels()[i].t_OtoI_s);
      newest_ns = std::max(newest_ns, imu_.back().t_ns - t_OtoI_ns);
    }
    forget_old(encoders_[i], newest_ns);
  }
  if (n_waiting_ > 0) {
    const auto until = forget_until(waiting_.front().t_ns, waiting_[n_waiting_ - 1].t_ns);
    if (until) drop_images(*until);
  }
  for (PoseStream& stream : poses_) {
    if (stream.waiting.empty()) continue;
    const auto until = forget_until(stream.waiting.front().t_ns, stream.waiting.back().t_ns);
    if (until) drop_poses(stream, *until);
  }
}

bool Estimator::attempt_is_due() {
  if (finished_) return !std::exchange(attempted_at_end_, true);
  if (imu_.empty() || imu_.back().t_ns < next_attempt_ns_) return false;
  next_attempt_ns_ = imu_.back().t_ns + kAttemptPeriodNs;
  return true;
}

bool Estimator::try_to_initialize() {
  if (!initializer_) return false;
  forget_before_start();
  if (!attempt_is_due()) return false;
  const StartAttempt attempt = initializer_(imu_, encoders_);
  if (attempt.prior) {
    start(*attempt.prior);
    return true;
  }
  const auto is_known = [&](const StartObstacle& known) { return known.text == attempt.obstacle; };
  auto known = std::find_if(start_obstacles_.begin(), start_obstacles_.end(), is_known);
  if (known == start_obstacles_.end()) {
    known = start_obstacles_.insert(known, {attempt.obstacle, 0});
  }
  ++known->count;
  return false;
}

}  // namespace viwo
