// Which integers are stamps.
#pragma once

#include <cstdint>

namespace viwo {

/// Within +-4e18 ns, which is 127 years: then differences of two do not overflow, also with a clock
/// that is some years off. What is beyond is no time of any clock.
inline constexpr bool is_stamp(std::int64_t t_ns) {
  constexpr std::int64_t kMostNs = 4'000'000'000'000'000'000;
  return t_ns >= -kMostNs && t_ns <= kMostNs;
}

}  // namespace viwo
