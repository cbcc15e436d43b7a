#include "topic_options.hpp"

#include <algorithm>
#include <set>

#include <ros/names.h>

#include "viwo/api/measurement.hpp"
#include "viwo/api/status.hpp"

namespace viwo::ros1 {
namespace {

void check_list(const std::string& key, const std::vector<std::string>& names, std::size_t most) {
  if (names.size() > most) {
    throw ParamError(key, std::to_string(names.size()) + " names, at most " + std::to_string(most) +
                              " are possible");
  }
  for (auto name = names.begin(); name != names.end(); ++name) {
    if (name->empty()) throw ParamError(key, "an empty name");
    if (std::find(names.begin(), name, *name) != name) {
      throw ParamError(key, "'" + *name + "' is there twice");
    }
  }
}

void check_topic(const std::string& key, const std::string& topic, std::set<std::string>& seen) {
  if (topic.empty()) return;
  std::string error;
  if (!ros::names::validate(topic, error)) {
    throw ParamError(key, "'" + topic + "' cannot be the name of a topic: " + error);
  }
  if (!seen.insert(topic).second) throw ParamError(key, "'" + topic + "' is wanted twice");
}

void check_topics(const TopicOptions& options) {
  constexpr std::size_t kMaxCameras = 16;
  check_list("image_topics", options.image_topics, kMaxCameras);
  std::set<std::string> seen;
  check_topic("imu_topic", options.imu_topic, seen);
  for (const std::string& topic : options.image_topics) check_topic("image_topics", topic, seen);
  check_topic("joint_topic", options.joint_topic, seen);
  check_topic("pose_topic", options.pose_topic, seen);
  check_topic("odometry_topic", options.odometry_topic, seen);
  if (seen.empty()) {
    throw ParamError("imu_topic",
                     "nothing to listen to: give one of imu_topic, image_topics, joint_topic, "
                     "pose_topic, odometry_topic");
  }
}

void check_joints(const TopicOptions& options) {
  check_list("drive_joints", options.drive_joints, kMaxDrives);
  check_list("steer_joints", options.steer_joints, kMaxSteers);
  if (!options.joint_topic.empty() && options.drive_joints.empty()) {
    throw ParamError("joint_topic", "a joint_topic needs drive_joints, the names of the wheels");
  }
  if (options.joint_topic.empty() &&
      !(options.drive_joints.empty() && options.steer_joints.empty())) {
    throw ParamError(options.drive_joints.empty() ? "steer_joints" : "drive_joints",
                     "names of joints need the joint_topic that they are on");
  }
}

}  // namespace

TopicOptions topic_options_from(const ParamSet& params) {
  const auto list = [&params](const char* name) {
    const auto texts = params.texts(name);
    return std::vector<std::string>(texts.begin(), texts.end());
  };
  TopicOptions options;
  options.imu_topic = params.text("imu_topic");
  options.image_topics = list("image_topics");
  options.joint_topic = params.text("joint_topic");
  options.drive_joints = list("drive_joints");
  options.steer_joints = list("steer_joints");
  options.drive_is_angle = params.text("drive_input") == "position";
  options.pose_topic = params.text("pose_topic");
  options.odometry_topic = params.text("odometry_topic");
  options.max_gap_s = params.number("max_gap_s");
  check_topics(options);
  check_joints(options);
  if (!options.pose_topic.empty() && !options.odometry_topic.empty()) {
    throw ParamError("odometry_topic",
                     "pose_topic and odometry_topic both give poses, which could not be told "
                     "apart: make two sensors of them");
  }
  return options;
}

}  // namespace viwo::ros1
