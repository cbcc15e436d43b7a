// The definitions of ROS 2 messages, as a bag in MCAP has them.
#pragma once

#include <string>

namespace viwo::bag {

/// Of "sensor_msgs/msg/Imu" and the other types that are written: its fields, then those of
/// all types that are used in it.
std::string ros2_definition(const std::string& type);

}  // namespace viwo::bag
