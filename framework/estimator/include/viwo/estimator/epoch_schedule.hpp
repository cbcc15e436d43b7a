// When an epoch ends, and when enough has come to make it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "viwo/estimator/imu_buffer.hpp"
#include "viwo/estimator/stream.hpp"

namespace viwo {

struct ScheduleOptions {
  /// Without a sample that ends one for this long an epoch ends without.
  double max_epoch_s = 0.25;
  /// How long (in stamps) an epoch waits for awaited streams that do not reach its end.
  double max_wait_s = 0.2;
  /// Measurements come in the order of their arrival and not of their stamps: how long (in stamps)
  /// an epoch waits for the other samples of its instant (StreamSpec::per_instant), s. 0: in the
  /// order of their stamps.
  double max_instant_wait_s = 0.;
};

/// The end of the epoch after `present_ns`, IMU clock; nothing as long as there is something to
/// wait for. `finished`: no further measurement will come.
std::optional<std::int64_t> next_epoch_ns(const ScheduleOptions& options, std::int64_t present_ns,
                                          const ImuBuffer& imu, std::span<const Stream> streams,
                                          const StateBlocks& blocks, bool finished);

}  // namespace viwo
