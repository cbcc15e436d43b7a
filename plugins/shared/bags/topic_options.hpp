// Which topics are wanted, and what is on them: of a bag as of a running system.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "viwo/api/params.hpp"
#include "viwo/api/sample.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo::bag {

inline constexpr std::array kTopicParams{
    ParamSpec{.name = "imu_topic",
              .type = ParamType::kString,
              .fallback = "",
              .help = "sensor_msgs/Imu; empty, here and below: not wanted"},
    ParamSpec{.name = "image_topics",
              .type = ParamType::kStrings,
              .fallback = "[]",
              .help = "sensor_msgs/Image or CompressedImage, in the order of the cameras"},
    ParamSpec{.name = "joint_topic",
              .type = ParamType::kString,
              .fallback = "",
              .help =
                  "sensor_msgs/JointState of the wheels; of a bag also nav_msgs/Odometry, whose "
                  "twist is taken as joints left and right: wheels of 1 m radius, 1 m apart"},
    ParamSpec{.name = "drive_joints",
              .type = ParamType::kStrings,
              .fallback = "[]",
              .help = "joints that drive, in the order of the wheels"},
    ParamSpec{.name = "steer_joints",
              .type = ParamType::kStrings,
              .fallback = "[]",
              .help = "joints that steer, in the order of the wheels"},
    ParamSpec{.name = "drive_input",
              .type = ParamType::kString,
              .fallback = "velocity",
              .choices = "velocity|position",
              .help = "drive rates from velocities, or from differences of positions"},
    ParamSpec{.name = "pose_topic",
              .type = ParamType::kString,
              .fallback = "",
              .help = "geometry_msgs/PoseStamped or PoseWithCovarianceStamped"},
    ParamSpec{.name = "odometry_topic",
              .type = ParamType::kString,
              .fallback = "",
              .help = "nav_msgs/Odometry, whose poses are taken"},
    ParamSpec{.name = "gnss_topic",
              .type = ParamType::kString,
              .fallback = "",
              .help = "sensor_msgs/NavSatFix"},
    log::kMaxGapParam};

struct TopicOptions {
  std::string imu_topic;
  std::vector<std::string> image_topics;
  std::string joint_topic;
  std::vector<std::string> drive_joints;
  std::vector<std::string> steer_joints;
  bool drive_is_angle = false;
  std::string pose_topic;
  std::string odometry_topic;
  std::string gnss_topic;
  double max_gap_s = 0.2;
};

/// The kinds of samples that the topics give.
SampleTypes kinds_of(const TopicOptions& options);

/// ParamError for parameters that contradict each other; where no topic is wanted, for `key`:
/// "nothing to <verb>".
TopicOptions topic_options_from(const ParamSet& params, const std::string& key,
                                const std::string& verb);

}  // namespace viwo::bag
