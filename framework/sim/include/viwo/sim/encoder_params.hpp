// What encoders of a simulated base read beside its motion: parameters that simulating sensors have
// in common.
#pragma once

#include <array>

#include "viwo/api/params.hpp"
#include "viwo/sim/encoder_simulator.hpp"

namespace viwo::sim {

/// What kEncoderParams, `duration_s`, `start_ns` and `noise` say; rate and time offset are the
/// sensor's own. ParamError for a wheel that `robot` does not have.
EncoderSimulation encoder_simulation_from(const ParamSet& params, const ModelDescription& robot);

// clang-format off
inline constexpr std::array kEncoderParams{
    ParamSpec{.name = "true_intrinsics_scale", .type = ParamType::kNumber, .fallback = "0",
              .min = 0.,
              .help = "0: the nominal intrinsics are true; s: nominal + s * prior sigma * gaussian"},
    ParamSpec{.name = "intrinsics_wander", .type = ParamType::kNumber, .fallback = "0", .min = 0.,
              .help = "each intrinsic wanders about its true value with a sigma of so many prior "
                      "sigmas (Gauss-Markov)"},
    ParamSpec{.name = "intrinsics_wander_time_s", .type = ParamType::kNumber, .unit = "s",
              .fallback = "2", .min = 0., .min_exclusive = true, .help = "its time constant"},
    ParamSpec{.name = "slip_start_s", .type = ParamType::kNumbers, .unit = "s", .fallback = "[]",
              .help = "when a wheel starts to spin, reading more than it rolls"},
    ParamSpec{.name = "slip_duration_s", .type = ParamType::kNumber, .unit = "s",
              .fallback = "0.5", .min = 0., .help = "for how long each time"},
    ParamSpec{.name = "slip_wheel", .type = ParamType::kInt, .fallback = "1", .min = 1.,
              .help = "drive channel that slips, from 1"},
    ParamSpec{.name = "slip_ratio", .type = ParamType::kNumber, .fallback = "0.3",
              .help = "0.3: the drive reads 30 % more than the wheel rolls"},
    ParamSpec{.name = "outlier_probability", .type = ParamType::kNumber, .fallback = "0",
              .min = 0., .max = 1.,
              .help = "probability per encoder sample that one drive channel is off"},
    ParamSpec{.name = "outlier_rad_per_s", .type = ParamType::kNumber, .unit = "rad/s",
              .fallback = "5", .min = 0., .help = "by how much, with either sign"},
    ParamSpec{.name = "drive_resolution_rad_per_s", .type = ParamType::kNumber, .unit = "rad/s",
              .fallback = "0", .min = 0.,
              .help = "drive rates are rounded to its multiples; 0: not rounded"},
};
// clang-format on

}  // namespace viwo::sim
