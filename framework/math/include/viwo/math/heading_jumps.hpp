// Headings that jump: somebody set the gyro to zero while it was read.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

#include "viwo/api/measurement.hpp"

namespace viwo {

/// Samples whose heading is further from the one before than the base turns in that time: more than
/// 15 rad/s, as no wheels do, and five times what is fast in the recording, whose unit may be
/// another.
inline std::vector<std::size_t> heading_jumps(std::span<const HeadingSample> headings) {
  constexpr double kFastest_rad_per_s = 15., kTimesTheFast = 5., kFast = 0.98;
  std::vector<double> rates;
  for (std::size_t i = 1; i < headings.size(); ++i) {
    const double change =
        std::remainder(headings[i].yaw_rad - headings[i - 1].yaw_rad, 2. * std::numbers::pi);
    const double dt_s = seconds_between(headings[i - 1].t_ns, headings[i].t_ns);
    rates.push_back(dt_s > 0. ? std::abs(change) / dt_s : 0.);
  }
  if (rates.empty()) return {};
  std::vector<double> sorted = rates;
  const auto fast =
      sorted.begin() + static_cast<std::ptrdiff_t>(kFast * static_cast<double>(sorted.size() - 1));
  std::nth_element(sorted.begin(), fast, sorted.end());
  const double most = std::max(kFastest_rad_per_s, kTimesTheFast * *fast);
  std::vector<std::size_t> jumps;
  for (std::size_t i = 0; i < rates.size(); ++i) {
    if (rates[i] > most) jumps.push_back(i + 1);
  }
  return jumps;
}

}  // namespace viwo
