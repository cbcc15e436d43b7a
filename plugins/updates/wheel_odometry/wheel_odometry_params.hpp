// What a configuration can say about wheel_odometry.
#pragma once

#include "viwo/api/params.hpp"
#include "wheel_params.hpp"

namespace viwo::wheel_odometry {

struct Params : WheelUpdateParams {
  enum class TwistWeights { kPlain, kNoise };
  TwistWeights twist = TwistWeights::kNoise;
  double noise_scale = 1.;
  double sigma_floor_yaw_rad = 3e-5;
  double sigma_floor_position_m = 3e-5;
  double sigma_yaw_rad_per_sqrt_m = 0.;
  double sigma_position_m_per_sqrt_m = 0.;
  int max_iterations = 5;
  double max_bridged_s = 0.05;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(twist),
      {{"plain", TwistWeights::kPlain}, {"noise_weighted", TwistWeights::kNoise}},
      {.help = "least squares of the wheel rows: plain, or weighted by their noise (then "
               "independent of the parity residual)"});
    b(VIWO_PARAM(noise_scale),
      {.above = 0., .help = "factor on the standard deviation that the encoder noise gives"});
    b(VIWO_PARAM(sigma_floor_yaw_rad),
      {.unit = "rad",
       .min = 0.,
       .help = "yaw noise of each interval on top of the encoders'; not below what gyro noise "
               "alone turns in an interval"});
    b(VIWO_PARAM(sigma_floor_position_m),
      {.unit = "m",
       .min = 0.,
       .help = "position noise of each interval on top of the encoders', per axis; not below "
               "that turn times the height of the IMU above O"});
    b(VIWO_PARAM(sigma_yaw_rad_per_sqrt_m),
      {.unit = "rad/sqrt(m)", .min = 0., .help = "yaw noise that grows with the path, for slip"});
    b(VIWO_PARAM(sigma_position_m_per_sqrt_m),
      {.unit = "m/sqrt(m)",
       .min = 0.,
       .help = "position noise per axis that grows with the path, for slip"});
    b(VIWO_PARAM(max_iterations),
      {.min = 1, .max = 20, .help = "linearisations per interval at most; 1: a plain EKF update"});
    b(VIWO_PARAM(max_bridged_s),
      {.unit = "s",
       .min = 0.,
       .help = "intervals with longer holes in the encoder data are left out"});
    WheelUpdateParams::bind(b);
  }

  void make_exact() {
    WheelUpdateParams::make_exact();
    max_iterations = 1;
  }
};

}  // namespace viwo::wheel_odometry
