// What the sensors of a run gave.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "viwo/feed/recorded.hpp"
#include "viwo/math/trajectory.hpp"
#include "viwo/setup/run_setup.hpp"

namespace viwo {

/// A sensor that is read while the filter runs: what turns images into tracks.
struct SensorStream {
  std::string name;
  PluginInfo info;
  std::shared_ptr<Sensor> sensor;
  std::string input_name;
  std::shared_ptr<Sensor> input;  ///< what it reads from; null where that is a live sensor
};

/// What the sensors of a run gave, as far as somebody wants it.
struct RunData {
  Recorded recorded;
  std::string wheels_name;                    ///< sensor that gave the encoder samples
  Trajectory reference;                       ///< planar; empty if there is none
  std::vector<SensorStream> streams;          ///< not read yet
  std::vector<SensorStream> live;             ///< measurements that are still to happen
  bool lockstep = false;                      ///< these are played: the run waits for them
  std::map<std::string, double> calibration;  ///< true values, if known
  std::vector<std::pair<std::string, RejectionCount>> rejections;  ///< by sensor

  std::span<const ImuSample> imu() const { return recorded.of<ImuSample>(); }
  std::span<const HeadingSample> headings() const { return recorded.of<HeadingSample>(); }
  /// Of the first wheel set.
  std::span<const EncoderSample> wheels() const { return recorded.of<EncoderSample>(wheels_name); }
  /// Truth of the inertial state, if there is one.
  std::span<const StateSample> states() const { return recorded.of<StateSample>(); }
  /// Whether measurements come in their own time, which does not wait for the run.
  bool is_live() const { return !live.empty() && !lockstep; }
  /// For pictures: what has not been read by a tracker while it ran.
  std::span<const ImageSample> images() const { return recorded.of<ImageSample>(); }
};

/// Whether measurements may still be to happen; then none may have been recorded.
enum class LiveSensors { kRefused, kAllowed };

/// Reads all sensors to their end, but for the last of a chain of sensors that take inputs: the
/// filter is going to read that one, and only once. Throws InputError when a sensor gives nothing
/// of what is wanted from it, when channels do not fit the model, or when a sensor's input is
/// broken.
RunData collect(RunSetup& setup, LiveSensors live = LiveSensors::kRefused);

}  // namespace viwo
