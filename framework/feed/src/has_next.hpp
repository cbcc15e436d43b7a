// What sensors answer when they are asked for the next measurement, or to stop.
#pragma once

#include <exception>
#include <string>

#include "viwo/api/sensor.hpp"
#include "viwo/setup/run_setup.hpp"

namespace viwo {

/// PluginFailure for an answer that next() does not have: what a sensor cannot use it counts itself
/// (rejections()).
inline void require_answer(const PluginInfo& info, Status status) {
  if (status == Status::kOk || status == Status::kEnd) return;
  throw PluginFailure(info, "next",
                      "it answered neither kOk nor kEnd; what a sensor drops it goes on from, and "
                      "counts in rejections()");
}

/// What a report says of a sensor whose stop() threw.
inline std::string not_stopped_text(const std::exception& error) {
  return std::string("a sensor could not be stopped: ") + error.what();
}

inline bool has_next(const PluginInfo& info, Sensor& sensor, Measurement& out) {
  const Status status = guarded(info, "next", [&] { return sensor.next(out); });
  require_answer(info, status);
  return status == Status::kOk;
}

}  // namespace viwo
