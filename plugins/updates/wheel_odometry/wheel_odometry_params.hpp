// What a configuration can say about wheel_odometry.
#pragma once

#include <array>

#include "viwo/api/params.hpp"
#include "wheel_params.hpp"

namespace viwo::wheel_odometry {

inline constexpr std::array kParams{
    ParamSpec{.name = "twist",
              .type = ParamType::kString,
              .fallback = "noise_weighted",
              .choices = "plain|noise_weighted",
              .help = "least squares of the wheel rows: plain, or weighted by their noise (then "
                      "independent of the parity residual)"},
    kIntervalGateParam,
    kSampleGateParam,
    ParamSpec{.name = "noise_scale",
              .type = ParamType::kNumber,
              .fallback = "1",
              .min = 0.,
              .min_exclusive = true,
              .help = "factor on the standard deviation that the encoder noise gives"},
    ParamSpec{.name = "sigma_floor_yaw_rad",
              .type = ParamType::kNumber,
              .unit = "rad",
              .fallback = "3e-5",
              .min = 0.,
              .help =
                  "yaw noise of each interval on top of the encoders'; not below what gyro noise "
                  "alone turns in an interval"},
    ParamSpec{.name = "sigma_floor_position_m",
              .type = ParamType::kNumber,
              .unit = "m",
              .fallback = "3e-5",
              .min = 0.,
              .help =
                  "position noise of each interval on top of the encoders', per axis; not below "
                  "that turn times the height of the IMU above O"},
    ParamSpec{.name = "sigma_yaw_rad_per_sqrt_m",
              .type = ParamType::kNumber,
              .unit = "rad/sqrt(m)",
              .fallback = "0",
              .min = 0.,
              .help = "yaw noise that grows with the path, for slip"},
    ParamSpec{.name = "sigma_position_m_per_sqrt_m",
              .type = ParamType::kNumber,
              .unit = "m/sqrt(m)",
              .fallback = "0",
              .min = 0.,
              .help = "position noise per axis that grows with the path, for slip"},
    ParamSpec{.name = "max_iterations",
              .type = ParamType::kInt,
              .fallback = "5",
              .min = 1,
              .max = 20,
              .help = "linearisations per interval at most; 1: a plain EKF update"},
    kSecondOrderNoiseParam,
    kMotionParam,
    kWheelCheckParam,
    kFindNoiseParam,
    ParamSpec{.name = "max_bridged_s",
              .type = ParamType::kNumber,
              .unit = "s",
              .fallback = "0.05",
              .min = 0.,
              .help = "intervals with longer holes in the encoder data are left out"},
};

}  // namespace viwo::wheel_odometry
