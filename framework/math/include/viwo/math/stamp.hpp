// Which integers are stamps.
#pragma once

#include <cstdint>

#include "viwo/api/stamp_order.hpp"

namespace viwo {

/// Within +-kMaxStampNs, as the readers of recordings have it: differences of two do not overflow,
/// also with a clock that is some years off. What is beyond is no time of any clock.
inline constexpr bool is_stamp(std::int64_t t_ns) {
  return t_ns >= -kMaxStampNs && t_ns <= kMaxStampNs;
}

}  // namespace viwo
