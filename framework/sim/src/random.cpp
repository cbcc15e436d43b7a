#include "viwo/sim/random.hpp"

#include <cmath>

#include "viwo/math/mix.hpp"

namespace viwo::sim {

RandomStream::RandomStream(std::uint64_t seed, Stream purpose, std::uint64_t index)
    : engine_(mix64(mix64(seed) + static_cast<std::uint64_t>(purpose) + (index << 32U))) {}

double RandomStream::uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }

double RandomStream::gaussian() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  // Box-Muller; 1 - u is in (0, 1], so the logarithm is finite.
  const double radius = std::sqrt(-2. * std::log(1. - uniform()));
  const double angle = 2. * M_PI * uniform();
  spare_ = radius * std::sin(angle);
  has_spare_ = true;
  return radius * std::cos(angle);
}

}  // namespace viwo::sim
