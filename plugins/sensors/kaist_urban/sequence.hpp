// The files of one sequence of the KAIST Complex Urban dataset (model.md).
#pragma once

#include <cstdint>
#include <filesystem>

#include "viwo/log/recording.hpp"

namespace viwo::kaist {

/// A sequence's folder. Reading anything throws an InputError for what is wrong with it; a file
/// that is not there is named, with what it is for and the parameter that does without it.
class Sequence {
 public:
  Sequence(std::filesystem::path folder, const LogLimits& limits);

  /// Angular rate and specific force from sensor_data/xsens_imu.csv.
  log::ImuRecording imu() const;
  /// Mean rates of the left and the right rear wheel between the rows of sensor_data/encoder.csv.
  /// `ticks_per_turn`: 0 for what calibration/EncoderParameter.txt says. `joints`: of its angles.
  log::EncoderRecording wheels(std::int64_t ticks_per_turn, const log::JointParams& joints) const;
  /// Poses of the vehicle from global_pose.csv.
  log::PoseRecording reference() const;
  /// The images of camera 0 (left) or 1 (right) at the stamps of sensor_data/stereo_stamp.csv.
  log::Recording<ImageSample> images(int camera) const;

 private:
  std::int64_t encoder_resolution() const;

  std::filesystem::path folder_;
  LogLimits limits_;
};

}  // namespace viwo::kaist
