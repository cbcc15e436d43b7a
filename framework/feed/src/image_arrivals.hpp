// When the images of live sensors came: what a pose is late by.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <limits>
#include <mutex>
#include <utility>

namespace viwo {

/// Of the last images. Threads of sensors note, the estimator's asks.
class ImageArrivals {
 public:
  /// `t_ns`: by the clock of the IMU.
  void note(std::int64_t t_ns) {
    const std::scoped_lock lock(mutex_);
    seen_.emplace_back(t_ns, Clock::now());
    if (seen_.size() > kMost) seen_.pop_front();
  }

  /// Since the arrival of the newest image of an epoch; NaN without one.
  double latency_s(std::int64_t t_ns) {
    const std::scoped_lock lock(mutex_);
    double latency = std::numeric_limits<double>::quiet_NaN();
    std::int64_t nearest = kMaxClockOffsetNs;
    for (const auto& [stamp, arrived] : seen_) {
      const std::int64_t off = std::abs(stamp - t_ns);
      if (off > nearest) continue;
      nearest = off;
      latency = std::chrono::duration<double>(Clock::now() - arrived).count();
    }
    return latency;
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMost = 64;
  /// Clocks of cameras are nearer to what is configured of them than this.
  static constexpr std::int64_t kMaxClockOffsetNs = 50'000'000;

  std::mutex mutex_;
  std::deque<std::pair<std::int64_t, Clock::time_point>> seen_;  ///< stamp and arrival
};

}  // namespace viwo
