// How the estimator comes to a start when it is not given a state.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "viwo/filter/filter.hpp"

namespace viwo {

/// No start looks at more than this before it (estimator.start_window_s has that bound).
inline constexpr std::int64_t kMaxStartWindowNs = 60'000'000'000;

/// A state to start from, or what is in the way of one so far.
struct StartAttempt {
  std::optional<ImuPrior> prior;
  std::string_view obstacle;  ///< a text that outlives everything, completes "none: ..."
};

inline StartAttempt no_start(std::string_view obstacle) { return {std::nullopt, obstacle}; }

/// What was measured so far.
struct StartData {
  std::span<const ImuSample> imu;
  std::span<const SampleSpan> streams;  ///< by StreamId::index

  template <Sample T>
  std::span<const T> samples(StreamId id) const {
    const SampleSpan& samples = streams[static_cast<std::size_t>(id.index)];
    return {static_cast<const T*>(samples.data), samples.size};
  }
};

/// Finds a state to start from, or says why not yet. Asked at most every 50 ms of the IMU's stamps,
/// and once when no further measurement will come.
using Initializer = std::function<StartAttempt(const StartData& data)>;

/// In how many attempts something was in the way of a start.
struct StartObstacle {
  std::string_view text;
  std::int64_t count = 0;
};

class StartSearch {
 public:
  void set(Initializer initializer) { initializer_ = std::move(initializer); }
  /// Whether there is something to try with, enough new since the last attempt, or nothing more to
  /// wait for.
  bool is_due(std::span<const ImuSample> imu, bool finished);
  std::optional<ImuPrior> attempt(const StartData& data);
  /// What every attempt has met so far, in the order of their first times.
  std::span<const StartObstacle> obstacles() const { return obstacles_; }

 private:
  Initializer initializer_;
  std::vector<StartObstacle> obstacles_;
  std::int64_t next_ns_ = std::numeric_limits<std::int64_t>::min();
  bool attempted_at_end_ = false;
};

}  // namespace viwo
