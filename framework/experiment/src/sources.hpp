// Which sensor of a run gives what: each kind of measurement comes from one.
#pragma once

#include <string>

#include "viwo/experiment/run.hpp"

namespace viwo::experiment {

// What is claimed, for messages.
inline constexpr const char* kEncoderSamples = "encoder samples";
inline constexpr const char* kImuSamples = "IMU samples";
inline constexpr const char* kReferencePoses = "reference poses";
inline constexpr const char* kTracks = "tracks";

/// Makes `sensor` the `owner` of what it gives; InputError at `mark` when that is another one.
inline void claim(std::string& owner, const std::string& sensor, const char* what,
                  const config::Mark& mark) {
  if (owner.empty()) owner = sensor;
  if (owner == sensor) return;
  config::fail(mark, "both '" + owner + "' and '" + sensor + "' give " + what +
                         ": a run takes them from one sensor");
}

}  // namespace viwo::experiment
