// How a simulated base drives on which ground: parameters that simulating sensors have in common.
#pragma once

#include <array>

#include "viwo/api/params.hpp"
#include "viwo/sim/body_trajectory.hpp"

namespace viwo::sim {

/// The trajectory of kDriveParams from before time 0 to behind `end_s`, with `margin_s` more at
/// both ends, and half a second in which the ends of its spline do not matter; `sideways` as for
/// BodyTrajectory::drive(). ParamError for what cannot be driven.
BodyTrajectory drive_from(const ParamSet& params, double end_s, double margin_s,
                          const SidewaysVelocity& sideways = {});

/// Names of PlanarMotion.
inline constexpr const char* kMotionChoices =
    "icr_sweep|straight|lateral|circle|stationary|figure_eight|crab_varying|"
    "spin|constant_steering|pivot|sweep_then_straight|mixed";

// clang-format off
inline constexpr std::array kDriveParams{
    ParamSpec{.name = "motion", .type = ParamType::kString, .fallback = "icr_sweep",
              .choices = kMotionChoices,
              .help = "how the base moves"},
    ParamSpec{.name = "duration_s", .type = ParamType::kNumber, .unit = "s", .fallback = "60",
              .min = 0., .max = 7200., .min_exclusive = true, .help = "how long"},
    ParamSpec{.name = "speed_m_per_s", .type = ParamType::kNumber, .unit = "m/s",
              .fallback = "0.5", .min = -20., .max = 20., .help = "speed of the motion"},
    ParamSpec{.name = "yaw_rate_rad_per_s", .type = ParamType::kNumber, .unit = "rad/s",
              .fallback = "0.6", .min = -6., .max = 6.,
              .help = "constant or peak yaw rate of the motions that turn"},
    ParamSpec{.name = "pivot_m", .type = ParamType::kNumbers, .unit = "m", .fallback = "[0, 0]",
              .help = "point of the base that motion pivot turns about"},
    ParamSpec{.name = "ramp_s", .type = ParamType::kNumber, .unit = "s", .fallback = "1", .min = 0.,
              .max = 3600., .help = "smooth start from rest; 0: at speed from the beginning"},
    ParamSpec{.name = "ground", .type = ParamType::kString, .fallback = "flat",
              .choices = "flat|uneven", .help = "what the base drives on"},
    ParamSpec{.name = "ground_amplitude_m", .type = ParamType::kNumber, .unit = "m",
              .fallback = "0.05", .min = 0., .max = 10., .help = "of the waves of uneven ground"},
    ParamSpec{.name = "ground_wavelength_m", .type = ParamType::kNumber, .unit = "m",
              .fallback = "3", .min = 0.1, .max = 1000., .help = "of the waves of uneven ground"},
    ParamSpec{.name = "start_ns", .type = ParamType::kInt, .unit = "ns", .fallback = "0",
              .min = 0., .max = 4e18, .help = "stamp at which the motion starts"},
};
// clang-format on

}  // namespace viwo::sim
