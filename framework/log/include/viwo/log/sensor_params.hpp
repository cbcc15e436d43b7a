// Parameters that the sensors which play logs back have in common, and joined() for tables.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "viwo/api/params.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/recording.hpp"
#include "viwo/log/ros_text.hpp"

namespace viwo::log {

/// Several parameter tables as one.
template <std::size_t... N>
constexpr auto joined(const std::array<ParamSpec, N>&... tables) {
  std::array<ParamSpec, (N + ...)> out{};
  std::size_t n = 0;
  const auto append = [&](const auto& table) {
    for (const ParamSpec& spec : table) out[n++] = spec;
  };
  (append(tables), ...);
  return out;
}

inline constexpr ParamSpec kMaxGapParam{
    .name = "max_gap_s",
    .type = ParamType::kNumber,
    .unit = "s",
    .fallback = "0.2",
    .min = 0.,
    .min_exclusive = true,
    .help = "longer spacings between stamps are gaps: counted, and not bridged by encoder cells"};

inline constexpr ParamSpec kMaxRejectedFractionParam{
    .name = "max_rejected_fraction",
    .type = ParamType::kNumber,
    .fallback = "0.1",
    .min = 0.,
    .max = 1.,
    .help = "more dropped rows than this make the log an error"};

inline constexpr ParamSpec kStrideParam{
    .name = "stride",
    .type = ParamType::kInt,
    .fallback = "1",
    .min = 1.,
    .max = 1000.,
    .help = "use every n-th reading of drive angles: longer cells, less noise from resolution"};

inline constexpr ParamSpec kClockParam{
    .name = "clock",
    .type = ParamType::kString,
    .fallback = "stamp",
    .choices = "stamp|reception",
    .help = "stamps from the message header, or from when the recorder received it"};

inline constexpr ParamSpec kReceptionUtcOffsetParam{
    .name = "reception_utc_offset_h",
    .type = ParamType::kNumber,
    .unit = "h",
    .fallback = "-7",
    .min = -14.,
    .max = 14.,
    .help = "how far the recorder's clock is ahead of UTC"};

inline LogLimits limits_from(const ParamSet& params) {
  return {params.number("max_gap_s"), params.number("max_rejected_fraction")};
}

inline RosClock clock_from(const ParamSet& params) {
  return {params.text("clock") == "reception", params.number("reception_utc_offset_h")};
}

/// With `angle_choice` the value of drive_input that stands for angles. ParamError for a stride
/// where the drives are rates.
inline EncoderRecordingOptions encoder_options_from(const ParamSet& params,
                                                    const std::string& angle_choice) {
  EncoderRecordingOptions options;
  options.limits = limits_from(params);
  options.drive_is_angle = params.text("drive_input") == angle_choice;
  options.stride = static_cast<int>(params.integer("stride"));
  if (options.stride > 1 && !options.drive_is_angle) {
    throw ParamError("stride", "a stride needs drive_input: " + angle_choice +
                                   " (rates between the used readings would be lost)");
  }
  return options;
}

}  // namespace viwo::log
