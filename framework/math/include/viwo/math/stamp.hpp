// Which integers are stamps, and seconds as stamps have them.
#pragma once

#include <cmath>
#include <cstdint>

#include "viwo/api/stamp_order.hpp"

namespace viwo {

/// Within +-kMaxStampNs, as the readers of recordings have it: differences of two do not overflow,
/// also with a clock that is some years off. What is beyond is no time of any clock.
inline constexpr bool is_stamp(std::int64_t t_ns) {
  return t_ns >= -kMaxStampNs && t_ns <= kMaxStampNs;
}

/// Seconds as whole nanoseconds, the nearest.
inline std::int64_t to_ns(double seconds) { return std::llround(1e9 * seconds); }

}  // namespace viwo
