// Headings that jump: somebody set the gyro to zero while it was read.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

#include "viwo/api/measurement.hpp"
#include "viwo/math/median.hpp"

namespace viwo {

/// Samples whose heading is further from the one before than the base turns: by more than 0.1 rad,
/// faster than 15 rad/s, as no wheels do, and five times as fast as what is fast in the recording,
/// whose unit may be another. Time counts as the usual spacing: after a pause in a log of what
/// changes the change is of its last moment, and stamps that come in pairs are none of the gyro.
inline std::vector<std::size_t> heading_jumps(std::span<const HeadingSample> headings) {
  constexpr double kLeast_rad = 0.1, kFastest_rad_per_s = 15., kTimesTheFast = 5.;
  std::vector<double> changes, spacings_s;
  for (std::size_t i = 1; i < headings.size(); ++i) {
    changes.push_back(std::abs(
        std::remainder(headings[i].yaw_rad - headings[i - 1].yaw_rad, 2. * std::numbers::pi)));
    spacings_s.push_back(seconds_between(headings[i - 1].t_ns, headings[i].t_ns));
  }
  if (changes.empty()) return {};
  const double usual_s = upper_median(spacings_s);
  std::vector<double> sorted = changes;
  const auto fast = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * 49 / 50);
  std::nth_element(sorted.begin(), fast, sorted.end());
  const double most = std::max({kLeast_rad, kFastest_rad_per_s * usual_s, kTimesTheFast * *fast});
  std::vector<std::size_t> jumps;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    if (changes[i] > most) jumps.push_back(i + 1);
  }
  return jumps;
}

}  // namespace viwo
