// Parameters that the sensors which play bags have in common.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "viwo/api/params.hpp"
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
              .help = "sensor_msgs/JointState of the wheels"},
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
    log::kStrideParam,
    ParamSpec{.name = "pose_topic",
              .type = ParamType::kString,
              .fallback = "",
              .help = "geometry_msgs/PoseStamped or PoseWithCovarianceStamped"},
    ParamSpec{.name = "odometry_topic",
              .type = ParamType::kString,
              .fallback = "",
              .help = "nav_msgs/Odometry, whose poses are taken"},
    log::kClockParam,
    ParamSpec{.name = "start_s",
              .type = ParamType::kNumber,
              .unit = "s",
              .fallback = "0",
              .min = 0.,
              .max = 1e9,
              .help = "leaves out what was recorded before this time after the first message"},
    ParamSpec{.name = "duration_s",
              .type = ParamType::kNumber,
              .unit = "s",
              .fallback = "0",
              .min = 0.,
              .max = 1e9,
              .help = "how long a piece is read from there; 0: up to the end"},
    log::kMaxGapParam,
    log::kMaxRejectedFractionParam};

/// A table of all parameters: those of one format before the common ones.
template <std::size_t N>
constexpr auto with_topic_params(const std::array<ParamSpec, N>& own) {
  std::array<ParamSpec, N + kTopicParams.size()> all{};
  for (std::size_t i = 0; i < N; ++i) all[i] = own[i];
  for (std::size_t i = 0; i < kTopicParams.size(); ++i) all[N + i] = kTopicParams[i];
  return all;
}

struct BagOptions {
  std::string imu_topic;
  std::vector<std::string> image_topics;
  std::string joint_topic;
  std::vector<std::string> drive_joints;
  std::vector<std::string> steer_joints;
  log::EncoderRecordingOptions encoders;  ///< its limits are those of all topics
  std::string pose_topic;
  std::string odometry_topic;
  bool by_reception = false;
  double start_s = 0.;
  double duration_s = 0.;
};

/// ParamError for parameters that contradict each other.
BagOptions options_from(const ParamSet& params);

}  // namespace viwo::bag
