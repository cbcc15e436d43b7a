// Seeds of streams of random numbers that have nothing in common.
#pragma once

#include <cstdint>

namespace viwo {

/// SplitMix64's output function: neighbouring values give unrelated ones.
constexpr std::uint64_t mix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

}  // namespace viwo
