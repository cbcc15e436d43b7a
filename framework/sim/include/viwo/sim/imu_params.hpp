// Noise of an IMU as a configuration gives it, of a simulated one as of the filter's.
#pragma once

#include "viwo/api/filter_view.hpp"
#include "viwo/api/params.hpp"

namespace viwo::sim {

struct ImuNoiseParams {
  double sigma_gyro_rad_per_s_sqrt_hz = ImuNoise{}.gyro_rad_per_s_sqrt_hz;
  double sigma_accel_m_per_s2_sqrt_hz = ImuNoise{}.accel_m_per_s2_sqrt_hz;
  double sigma_gyro_walk_rad_per_s2_sqrt_hz = ImuNoise{}.gyro_walk_rad_per_s2_sqrt_hz;
  double sigma_accel_walk_m_per_s3_sqrt_hz = ImuNoise{}.accel_walk_m_per_s3_sqrt_hz;

  /// A filter needs white noise that is not zero.
  void bind(ParamBinder& b, bool not_zero = false) {
    b(VIWO_PARAM(sigma_gyro_rad_per_s_sqrt_hz), {.unit = "rad/s/sqrt(Hz)",
                                                 .min = 0.,
                                                 .above = not_zero ? 0. : -1.,
                                                 .help = "white noise of the gyroscope"});
    b(VIWO_PARAM(sigma_accel_m_per_s2_sqrt_hz), {.unit = "m/s^2/sqrt(Hz)",
                                                 .min = 0.,
                                                 .above = not_zero ? 0. : -1.,
                                                 .help = "white noise of the accelerometer"});
    b(VIWO_PARAM(sigma_gyro_walk_rad_per_s2_sqrt_hz),
      {.unit = "rad/s^2/sqrt(Hz)", .min = 0., .help = "random walk of the gyroscope's bias"});
    b(VIWO_PARAM(sigma_accel_walk_m_per_s3_sqrt_hz),
      {.unit = "m/s^3/sqrt(Hz)", .min = 0., .help = "random walk of the accelerometer's bias"});
  }

  ImuNoise densities() const {
    return {sigma_gyro_rad_per_s_sqrt_hz, sigma_accel_m_per_s2_sqrt_hz,
            sigma_gyro_walk_rad_per_s2_sqrt_hz, sigma_accel_walk_m_per_s3_sqrt_hz};
  }
  void set_densities(const ImuNoise& noise) {
    sigma_gyro_rad_per_s_sqrt_hz = noise.gyro_rad_per_s_sqrt_hz;
    sigma_accel_m_per_s2_sqrt_hz = noise.accel_m_per_s2_sqrt_hz;
    sigma_gyro_walk_rad_per_s2_sqrt_hz = noise.gyro_walk_rad_per_s2_sqrt_hz;
    sigma_accel_walk_m_per_s3_sqrt_hz = noise.accel_walk_m_per_s3_sqrt_hz;
  }
};

}  // namespace viwo::sim
