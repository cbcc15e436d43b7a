#include "viwo/estimator/epoch_schedule.hpp"

#include <algorithm>

#include "viwo/math/stamp.hpp"

namespace viwo {
namespace {

constexpr std::int64_t kLeastEpochNs = 1'000'000;

/// Whether no further sample of the instant `t_ns` is to be expected; `newest_ns`: of the IMU and
/// of all streams that end epochs.
bool instant_is_complete(const ScheduleOptions& options, std::int64_t t_ns, std::int64_t newest_ns,
                         std::span<const Stream> streams, const StateBlocks& blocks) {
  const bool in_order = !(options.max_instant_wait_s > 0.);
  if (in_order && newest_ns <= t_ns) return false;
  if (newest_ns > t_ns + to_ns(in_order ? options.max_wait_s : options.max_instant_wait_s)) {
    return true;
  }
  return std::all_of(streams.begin(), streams.end(), [&](const Stream& stream) {
    if (!stream.spec().ends_epochs || stream.is_past(t_ns)) return true;
    const int n = stream.waiting_at(t_ns, blocks);
    // Stamps in order are those of the sensors' own clocks: where one sample of the instant is, the
    // others may be behind what is later for the IMU.
    return n >= stream.spec().per_instant || (in_order && n == 0);
  });
}

}  // namespace

std::optional<std::int64_t> next_epoch_ns(const ScheduleOptions& options, std::int64_t present_ns,
                                          const ImuBuffer& imu, std::span<const Stream> streams,
                                          const StateBlocks& blocks, bool finished) {
  if (imu.empty()) return std::nullopt;
  std::int64_t t_ns = present_ns + to_ns(options.max_epoch_s);
  std::int64_t newest_ns = imu.newest_ns();
  for (const Stream& stream : streams) {
    if (!stream.spec().ends_epochs) continue;
    newest_ns = std::max(newest_ns, stream.newest_ns());
    // A clock that has just been found to be another moves what waits: never back, and two clones
    // must not be the same.
    if (const auto end = stream.next_end_ns(blocks)) {
      t_ns = std::min(t_ns, std::max(*end, present_ns + kLeastEpochNs));
    }
  }
  if (imu.newest_ns() < t_ns) return std::nullopt;
  if (finished) return t_ns;
  if (!instant_is_complete(options, t_ns, newest_ns, streams, blocks)) return std::nullopt;
  if (seconds_between(t_ns, newest_ns) > options.max_wait_s) return t_ns;
  const bool reached = std::all_of(streams.begin(), streams.end(), [&](const Stream& stream) {
    return !stream.spec().awaited || stream.reaches(t_ns, blocks);
  });
  return reached ? std::optional(t_ns) : std::nullopt;
}

}  // namespace viwo
