// Parameters that the wheel updates have in common, for their tables.
#pragma once

#include "viwo/api/params.hpp"

namespace viwo {

inline constexpr ParamSpec kIntervalGateParam{
    .name = "gate_probability",
    .type = ParamType::kNumber,
    .fallback = "0.001",
    .min = 0.,
    .max = 0.5,
    .help = "intervals less likely than this are left out; 0: none"};

inline constexpr ParamSpec kSampleGateParam{
    .name = "sample_gate_probability",
    .type = ParamType::kNumber,
    .fallback = "0",
    .min = 0.,
    .max = 0.5,
    .help =
        "samples whose wheels contradict each other more than this are bridged; only for "
        "calibrated wheels; 0: none"};

inline constexpr ParamSpec kMotionParam{
    .name = "motion_sigmas",
    .type = ParamType::kNumber,
    .fallback = "5",
    .min = 0.,
    .max = 100.,
    .help =
        "what the wheels show of a motion within so many of its own sigmas teaches nothing about "
        "the "
        "calibration; 0: all that is measured is motion, noise too"};

inline constexpr ParamSpec kWheelCheckParam{
    .name = "wheel_check_probability",
    .type = ParamType::kNumber,
    .fallback = "1e-6",
    .min = 0.,
    .max = 0.5,
    .help =
        "of a sample whose wheels contradict each other more than this, the one that all others "
        "contradict is left out; 0: never"};

inline constexpr ParamSpec kFindNoiseParam{
    .name = "find_noise",
    .type = ParamType::kBool,
    .fallback = "true",
    .help = "the noise is scaled to what the residuals tell, and reported; false: as configured"};

inline constexpr ParamSpec kSecondOrderNoiseParam{
    .name = "second_order_noise",
    .type = ParamType::kBool,
    .fallback = "true",
    .help = "adds what the linearisation leaves out, as far as the prior is uncertain"};

}  // namespace viwo
