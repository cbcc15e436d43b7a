// Topics and types of ROS 2 as DDS has them.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace viwo::ros2 {

/// Why this cannot be the name of a topic; empty for one that can.
std::string why_no_name(const std::string& topic);

/// "/imu" or "imu" -> "rt/imu".
std::string dds_topic(const std::string& topic);
/// "rt/imu" -> "/imu"; nothing for a topic that is none of ROS.
std::optional<std::string> ros_topic(std::string_view topic);

/// "sensor_msgs/Imu" -> "sensor_msgs::msg::dds_::Imu_".
std::string dds_type(std::string_view type);
/// And back; another name stays as it is.
std::string ros_type(std::string_view type);

/// What an endpoint of "sensor_msgs/Imu" says of its type in its user data: the hash of the
/// definition (REP 2016, RIHS01), which ROS 2 of Iron and later looks for. Empty for a type that
/// viwo neither hears nor says.
std::string said_of_type(std::string_view type);

}  // namespace viwo::ros2
