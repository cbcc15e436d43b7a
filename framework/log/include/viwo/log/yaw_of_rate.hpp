// A heading of a gyro that gives the rate of the yaw alone.
#pragma once

#include <cstddef>
#include <vector>

#include "viwo/api/measurement.hpp"

namespace viwo::log {

/// Makes headings of samples that hold rates [rad/s] in their place: the integral from zero, by the
/// trapezoidal rule; over a spacing longer than `max_gap_s` the rate stays what it was, as in a log
/// of what changes.
inline void integrate_yaw(double max_gap_s, std::vector<HeadingSample>& samples) {
  double yaw_rad = 0., rate_before = 0.;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double rate = samples[i].yaw_rad;
    if (i > 0) {
      const double dt_s = seconds_between(samples[i - 1].t_ns, samples[i].t_ns);
      yaw_rad += dt_s * (dt_s > max_gap_s ? rate_before : 0.5 * (rate_before + rate));
    }
    rate_before = rate;
    samples[i].yaw_rad = yaw_rad;
  }
}

}  // namespace viwo::log
