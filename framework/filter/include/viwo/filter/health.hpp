// Whether a filter can go on.
#pragma once

#include <string>

#include "viwo/filter/filter.hpp"

namespace viwo {

/// What no robot does.
struct HealthLimits {
  double max_speed_m_per_s = 100.;
  double max_gyro_bias_rad_per_s = 1.;
  double max_accel_bias_m_per_s2 = 10.;
};

/// Why the filter cannot go on; empty as long as it can.
std::string failure_of(const Filter& filter, const HealthLimits& limits = {});

}  // namespace viwo
