// What goes out, as messages of ROS 2 in CDR.
#pragma once

#include <string>

#include "bag.hpp"
#include "estimate_messages.hpp"
#include "viwo/log/estimate_log.hpp"

namespace viwo::ros2 {

/// nav_msgs/Odometry
bag::Bytes odometry_message(const live::Odometry& odometry);
/// tf2_msgs/TFMessage: the transform of the same pose.
bag::Bytes tf_message(const live::Odometry& odometry);
/// nav_msgs/Path
bag::Bytes path_message(const live::Path& path, const std::string& world);
/// diagnostic_msgs/DiagnosticArray with one status.
bag::Bytes diagnostics_message(const live::Diagnostics& diagnostics);
/// sensor_msgs/JointState: name, estimate as position and sigma as effort of each parameter.
bag::Bytes calibration_message(const EstimateSample& estimate);
/// foxglove_msgs/ImageAnnotations: the points, from red (new) to green (seen for long).
bag::Bytes tracks_message(const log::SeenImage& image);

}  // namespace viwo::ros2
