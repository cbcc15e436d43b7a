// Which sensor of a run gives what: each kind of measurement comes from one.
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

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

/// The value at `key`, or an empty one.
template <class Samples>
const Samples& samples_or_none(const std::map<std::string, Samples>& by_sensor,
                               const std::string& key) {
  static const Samples kNone;
  const auto found = by_sensor.find(key);
  return found != by_sensor.end() ? found->second : kNone;
}

/// What the sensor of a wheel set gave; "" for the only sensor that gave encoder samples.
inline const std::vector<EncoderSample>& encoder_samples(const RunData& data,
                                                         const std::string& sensor) {
  if (sensor.empty() || sensor == data.wheels_name) return data.samples;
  return samples_or_none(data.other_wheels, sensor);
}

/// Whether an update measures with the poses of `pose_sensors[stream]`; not if all that would are
/// turned off.
inline bool is_measured(const FilterSetup& setup, std::size_t stream) {
  return std::any_of(setup.updates.begin(), setup.updates.end(), [stream](const auto& update) {
    return update.poses == static_cast<int>(stream);
  });
}

/// What a sensor gave for updates that measure with poses.
inline const std::vector<PoseSample>& pose_samples(const RunData& data, const std::string& sensor) {
  return samples_or_none(data.poses, sensor);
}

}  // namespace viwo::experiment
