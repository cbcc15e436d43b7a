// Parameters that the sensors which play logs back have in common.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "viwo/api/params.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/recording.hpp"
#include "viwo/log/ros_text.hpp"

namespace viwo::log {

/// ParamError for a list of names that is longer than `most`, or has an empty name, or one twice.
inline void check_names(const std::string& key, const std::vector<std::string>& names,
                        std::size_t most) {
  if (names.size() > most) {
    throw ParamError(key, std::to_string(names.size()) + " names, at most " + std::to_string(most) +
                              " are possible");
  }
  for (auto name = names.begin(); name != names.end(); ++name) {
    if (name->empty()) throw ParamError(key, "an empty name");
    if (std::find(names.begin(), name, *name) != name) {
      throw ParamError(key, "'" + *name + "' is there twice");
    }
  }
}
/// The same for a list that has as many as one of two numbers, or none.
inline void check_names(const std::string& key, const std::vector<std::string>& names,
                        std::size_t either, std::size_t or_else) {
  check_names(key, names, names.size());
  if (names.empty() || names.size() == either || names.size() == or_else) return;
  const std::string two = either == or_else ? "" : std::to_string(either) + " or ";
  throw ParamError(key, "needs " + two + std::to_string(or_else) + " names, not " +
                            std::to_string(names.size()));
}

struct MaxGapParams {
  double max_gap_s = 0.2;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(max_gap_s),
      {.unit = "s",
       .above = 0.,
       .help = "longer spacings between stamps are gaps: counted, and not bridged by encoder "
               "cells"});
  }
};

struct MaxRejectedParams {
  double max_rejected_fraction = 0.1;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(max_rejected_fraction),
      {.min = 0., .max = 1., .help = "more dropped rows than this make the log an error"});
  }
};

struct LimitParams : MaxGapParams, MaxRejectedParams {
  void bind(ParamBinder& b) {
    MaxGapParams::bind(b);
    MaxRejectedParams::bind(b);
  }
  LogLimits limits() const { return {max_gap_s, max_rejected_fraction}; }
};

struct StrideParams {
  int stride = 1;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(stride),
      {.min = 1.,
       .max = 1000.,
       .help = "use every n-th reading of drive angles: longer cells, less noise from resolution"});
  }

  /// ParamError where the drives are rates; `angles`: the value of drive_input that asks for
  /// angles.
  void check_stride(bool drive_is_angle, const std::string& angles) const {
    if (stride == 1 || drive_is_angle) return;
    throw ParamError("stride", "a stride needs drive_input: " + angles +
                                   " (rates between the used readings would be lost)");
  }
};

struct ClockParams {
  enum class Clock { kStamp, kReception };
  Clock clock = Clock::kStamp;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(clock), {{"stamp", Clock::kStamp}, {"reception", Clock::kReception}},
      {.help = "stamps from the message header, or from when the recorder received it"});
  }
  bool by_reception() const { return clock == Clock::kReception; }
};

struct TextClockParams : ClockParams {
  double reception_utc_offset_h = -7.;

  void bind(ParamBinder& b) {
    ClockParams::bind(b);
    b(VIWO_PARAM(reception_utc_offset_h), {.unit = "h",
                                           .min = -14.,
                                           .max = 14.,
                                           .help = "how far the recorder's clock is ahead of UTC"});
  }
  RosClock ros_clock() const { return {by_reception(), reception_utc_offset_h}; }
};

}  // namespace viwo::log
