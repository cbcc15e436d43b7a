// The estimate as messages of ROS.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "ros_messages.hpp"
#include "viwo/api/sensor.hpp"

namespace viwo::ros1 {

/// Frames of the messages, and where the IMU sits on the body whose pose is published.
struct OutputFrames {
  std::string world = "odom";
  std::string body = "imu";
  Eigen::Matrix3d R_ItoB = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinB = Eigen::Vector3d::Zero();
};

/// Pose of B in G, twist of B in B, and their covariances as ROS has them: position before
/// rotation, rotations about the axes of G. `sigma_rate_rad_per_s`: of each axis of the angular
/// rate.
msg::Odometry odometry_message(const EstimateSample& estimate, const OutputFrames& frames,
                               double sigma_rate_rad_per_s);

/// The transform of the same pose.
msg::TFMessage tf_message(const msg::Odometry& odometry);

/// What the estimate does not tell of how things are going.
struct Health {
  std::vector<std::string> silent_topics;
  std::int64_t rejected = 0;     ///< what was counted so far: messages that could not be used, gaps
  double warn_latency_s = 0.25;  ///< more than this is worth a warning
};

/// One status: latency, calibration with its sigmas, and a warning when something is off.
msg::DiagnosticArray diagnostics_message(const EstimateSample& estimate, const Health& health);

}  // namespace viwo::ros1
