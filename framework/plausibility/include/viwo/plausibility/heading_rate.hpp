// The yaw rate of a gyro that integrates for itself.
#pragma once

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>

#include "viwo/api/measurement.hpp"

namespace viwo {

/// Mean rate [rad/s] between two headings, which may wrap after a turn. Nothing without time
/// between them, or where they jump by more than a turn: they are in degrees, and wrap.
inline std::optional<double> yaw_rate_between(const HeadingSample& from, const HeadingSample& to) {
  constexpr double kTurn = 2. * std::numbers::pi;
  const double dt_s = seconds_between(from.t_ns, to.t_ns);
  const double change = to.yaw_rad - from.yaw_rad;
  if (dt_s <= 0. || std::abs(change) > 1.25 * kTurn) return {};
  return (std::abs(change) > 0.75 * kTurn ? std::remainder(change, kTurn) : change) / dt_s;
}

}  // namespace viwo
