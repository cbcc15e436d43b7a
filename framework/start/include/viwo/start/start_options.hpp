// What every way to find a first state is told.
#pragma once

#include "viwo/api/filter_view.hpp"

namespace viwo {

struct StartOptions {
  double window_s = 1.;
  ImuNoise noise;
  double gravity_m_per_s2 = 9.81;
  double sigma_position_m = 0.01;           ///< of the origin, a matter of definition
  double sigma_yaw_rad = 0.01;              ///< likewise
  double sigma_gyro_bias_rad_per_s = 0.02;  ///< at rest a mean rate beyond three is a motion
  double sigma_accel_bias_m_per_s2 = 0.05;  ///< tilts the estimate of gravity (F-10)
};

}  // namespace viwo
