// Log folders in the layout of the EuRoC/ASL datasets, extended by wheels:
//   wheels0/data.csv                       timestamp_ns, drive_1..N [rad/s], steer_1..M [rad]
//   state_groundtruth_estimate0/data.csv   the EuRoC columns
#pragma once

#include <filesystem>
#include <memory>

#include "viwo/api/measurement.hpp"
#include "viwo/log/recording.hpp"

namespace viwo::log {

/// Reads an encoder table, given as the file or as the folder of its data.csv. The stamp column is
/// `timestamp_ns`, `timestamp [ns]` or `timestamp`; drive channels are in rad/s, or in rad with
/// drive_is_angle. InputError for what is wrong with the file.
EncoderRecording read_asl_encoders(const std::filesystem::path& path,
                                   const EncoderRecordingOptions& options);

/// Reads stamps, positions and quaternions of a ground truth table, given as the file or its
/// folder.
PoseRecording read_asl_poses(const std::filesystem::path& path, const LogLimits& limits);

/// Writes measurements into a log folder that the readers above read back to the same bits (but for
/// the cells of encoder samples, which follow from the stamps).
class AslWriter {
 public:
  /// Creates the folder. An earlier log in it is replaced; InputError when it holds anything else.
  explicit AslWriter(const std::filesystem::path& folder);
  ~AslWriter();
  AslWriter(const AslWriter&) = delete;
  AslWriter& operator=(const AslWriter&) = delete;

  /// Appends to the table of its kind. std::runtime_error when writing fails, std::logic_error when
  /// encoder samples change their number of channels.
  void write(const Measurement& measurement);
  /// Must be called at the end: the last bytes may fail, too.
  void close();

 private:
  struct Tables;
  std::unique_ptr<Tables> tables_;
};

}  // namespace viwo::log
