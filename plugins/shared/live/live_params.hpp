// Parameters that the sensors of running systems have in common: all but how the system is found.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "estimate_messages.hpp"
#include "topic_options.hpp"
#include "viwo/api/params.hpp"

namespace viwo::live {

struct LiveParams : bag::TopicOptions {
  double idle_timeout_s = 0.;
  int max_waiting_images = 32;
  bool publish = true;
  std::string odometry_topic_out = "viwo/odometry";
  std::string path_topic_out = "viwo/path";
  std::string calibration_topic_out = "viwo/calibration";
  bool publish_tf = true;
  std::string world_frame = "odom";
  std::string body_frame = "imu";
  std::string imu_frame;
  std::string wheel_frame;
  std::vector<std::string> camera_frames;
  std::string description_topic = "/robot_description";
  Eigen::Vector3d p_IinB_m{0., 0., 0.};
  Eigen::Vector3d rpy_ItoB_rad{0., 0., 0.};
  double sigma_rate_rad_per_s = 0.01;
  double warn_latency_s = 0.25;

  void bind(ParamBinder& b);
  /// ParamError for frames without a name, or of the same.
  OutputFrames frames() const;
  /// Itself; ParamError for topics that `why_no_name` (a text, empty for a good name) does not
  /// take, for topics that are wanted twice and for parameters that contradict each other.
  const LiveParams& checked(std::string (*why_no_name)(const std::string& topic)) const;
};

}  // namespace viwo::live
