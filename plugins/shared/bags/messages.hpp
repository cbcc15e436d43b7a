// The messages that are read from bags, whichever ROS wrote them: their fields are the same.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "field_reader.hpp"
#include "viwo/api/measurement.hpp"

namespace viwo::bag {

enum class Kind : std::uint8_t {
  kImu,
  kImage,
  kCompressedImage,
  kJoints,
  kPose,
  kPoseWithCovariance,
  kOdometry,
  kNavSatFix
};

/// Of "sensor_msgs/Imu" (ROS 1) as of "sensor_msgs/msg/Imu" (ROS 2); nothing for a type that is not
/// read.
std::optional<Kind> kind_of(std::string_view type);

/// "sensor_msgs/Imu"
std::string_view type_name(Kind kind);

/// Of the definition that is read, as ROS 1 gives it.
std::string_view ros1_md5(Kind kind);

/// sensor_msgs/JointState without the efforts.
struct Joints {
  std::int64_t t_ns = 0;
  std::vector<std::string> names;
  std::vector<double> positions;
  std::vector<double> velocities;
};

/// One of a tf2_msgs/TFMessage: pose of the frame `child` in `parent`.
struct Transform {
  std::string parent, child;
  std::array<double, 3> p_m{};
  std::array<double, 4> q_xyzw{};
};

/// What stands before the pixels of a sensor_msgs/Image.
struct ImageHead {
  std::int64_t t_ns = 0;
  std::uint32_t height_px = 0;
  std::uint32_t width_px = 0;
  std::string encoding;
  bool big_endian = false;
  std::uint32_t row_bytes = 0;
};

/// All throw BrokenMessage.
ImuSample read_imu(FieldReader& in);
Joints read_joints(FieldReader& in);
/// The twist of a nav_msgs/Odometry as the velocities of three joints: `v_x`, `v_y` [m/s] and
/// `omega_z` [rad/s].
Joints read_twist(FieldReader& in);
/// PoseStamped, PoseWithCovarianceStamped or Odometry.
PoseSample read_pose(Kind kind, FieldReader& in);
/// sensor_msgs/NavSatFix. Nothing when it says that there is no fix. A covariance that is said to
/// be unknown is zero, one of which the diagonal is known has no more.
std::optional<GnssSample> read_fix(FieldReader& in);
std::vector<Transform> read_transforms(FieldReader& in);
/// Leaves `in` at the pixels.
ImageHead read_image_head(FieldReader& in);

/// Whether to_grey() reads the encoding.
bool is_known_encoding(std::string_view encoding);
std::string known_encodings();

/// Whether a sensor_msgs/CompressedImage of this format has depths, which are not read.
bool is_depth(std::string_view format);

/// Grey pixels of a sensor_msgs/Image; 16 bit become the upper 8, colours and Bayer patterns become
/// grey as OpenCV does it. BrokenMessage for sizes that contradict each other.
void to_grey(const ImageHead& head, std::span<const std::uint8_t> pixels, Image& out);

}  // namespace viwo::bag
