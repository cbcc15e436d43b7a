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

inline constexpr ParamSpec kSecondOrderNoiseParam{
    .name = "second_order_noise",
    .type = ParamType::kBool,
    .fallback = "true",
    .help = "adds what the linearisation leaves out, as far as the prior is uncertain"};

}  // namespace viwo
