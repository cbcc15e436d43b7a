// A motion with every component of the twist, for the tests of preintegration.
#pragma once

#include <cmath>
#include <cstdint>

#include "viwo/wheel/wheel_model.hpp"

namespace viwo {

inline constexpr std::int64_t kSecond = 1'000'000'000;

inline Twist wavy(double t) {
  return {0.4 * std::cos(0.9 * t), 0.3 * std::sin(1.3 * t), 0.7 * std::sin(0.8 * t)};
}

}  // namespace viwo
