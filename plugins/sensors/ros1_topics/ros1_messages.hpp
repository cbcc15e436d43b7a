// What goes out, as messages of ROS 1.
#pragma once

#include <string>

#include "estimate_messages.hpp"
#include "ros_messages.hpp"

namespace viwo::ros1 {

msg::Odometry odometry_message(const live::Odometry& odometry);
/// The transform of the same pose.
msg::TFMessage tf_message(const live::Odometry& odometry);
msg::Path path_message(const live::Path& path, const std::string& world);
/// One status.
msg::DiagnosticArray diagnostics_message(const live::Diagnostics& diagnostics);
/// Name, estimate as position and sigma as effort of each parameter.
msg::JointState calibration_message(const EstimateSample& estimate);

}  // namespace viwo::ros1
