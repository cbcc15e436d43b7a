// What goes out, as messages of ROS 2 in CDR.
#pragma once

#include <string>

#include "bag.hpp"
#include "estimate_messages.hpp"

namespace viwo::ros2 {

/// nav_msgs/Odometry
bag::Bytes odometry_message(const live::Odometry& odometry);
/// tf2_msgs/TFMessage: the transform of the same pose.
bag::Bytes tf_message(const live::Odometry& odometry);
/// nav_msgs/Path
bag::Bytes path_message(const live::Path& path, const std::string& world);
/// diagnostic_msgs/DiagnosticArray with one status.
bag::Bytes diagnostics_message(const live::Diagnostics& diagnostics);

}  // namespace viwo::ros2
