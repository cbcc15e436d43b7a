// Recordings of ROS messages printed as text, one row per message: JointState and PoseStamped with
// the columns `time`, `.header.stamp.secs`, `.name`, `.position`, `.pose.position.x`, ...
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/log/recording.hpp"

namespace viwo::log {

/// Which of the two stamps of a row is used.
struct RosClock {
  bool reception = false;              ///< the column `time` instead of `.header.stamp`
  double reception_utc_offset_h = 0.;  ///< of the clock that wrote the column `time`
};

struct RosEncoderOptions {
  EncoderRecordingOptions recording;
  RosClock clock;
  std::vector<std::string> drive;  ///< joint names in the order of the channels, 1 to kMaxDrives
  std::vector<std::string> steer;  ///< 0 to kMaxSteers
};

/// Steering angles are the joints' positions, drive channels the positions (drive_is_angle) or the
/// velocities. Rows without one of the joints are rejected. InputError for what is wrong with the
/// file; ParamError with key `drive` or `steer` for joints that the file does not have.
EncoderRecording read_ros_encoders(const std::filesystem::path& file,
                                   const RosEncoderOptions& options);

/// Positions and quaternions of PoseStamped messages.
PoseRecording read_ros_poses(const std::filesystem::path& file, const RosClock& clock,
                             const LogLimits& limits);

/// Items of "[a, b]" or "(a, b)", without quotes; nothing when there are no brackets around it.
std::optional<std::vector<std::string_view>> parse_list(std::string_view text);

/// "yyyy/MM/dd/HH:mm:ss" with up to nine decimals, read at a clock `utc_offset_h` ahead of UTC, as
/// nanoseconds since 1970 in UTC; nothing when the text is no such time.
std::optional<std::int64_t> parse_reception_ns(std::string_view text, double utc_offset_h);

}  // namespace viwo::log
