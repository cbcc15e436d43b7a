#include "topic_options.hpp"

#include <algorithm>
#include <cstddef>

#include "viwo/api/measurement.hpp"
#include "viwo/api/status.hpp"
#include "viwo/log/asl.hpp"

namespace viwo::bag {
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

void check(const TopicOptions& options, const std::string& key, const std::string& verb) {
  check_list("image_topics", options.image_topics, log::kMaxCamera + 1);
  check_list("drive_joints", options.drive_joints, kMaxDrives);
  check_list("steer_joints", options.steer_joints, kMaxSteers);
  if (options.imu_topic.empty() && options.image_topics.empty() && options.joint_topic.empty() &&
      options.pose_topic.empty() && options.odometry_topic.empty() && options.gnss_topic.empty()) {
    throw ParamError(key, "nothing to " + verb +
                              ": give one of imu_topic, image_topics, joint_topic, "
                              "pose_topic, odometry_topic, gnss_topic");
  }
  if (!options.joint_topic.empty() && options.drive_joints.empty()) {
    throw ParamError("joint_topic", "a joint_topic needs drive_joints, the names of the wheels");
  }
  if (options.joint_topic.empty() &&
      !(options.drive_joints.empty() && options.steer_joints.empty())) {
    throw ParamError(options.drive_joints.empty() ? "steer_joints" : "drive_joints",
                     "names of joints need the joint_topic that they are on");
  }
  if (!options.pose_topic.empty() && !options.odometry_topic.empty()) {
    throw ParamError("odometry_topic",
                     "pose_topic and odometry_topic both give poses, which could not be told "
                     "apart: make two sensors of them");
  }
}

}  // namespace

SampleTypes kinds_of(const TopicOptions& options) {
  SampleTypes out;
  const bool any_pose = !options.pose_topic.empty() || !options.odometry_topic.empty();
  if (any_pose) out.push_back(&sample_type<PoseSample>());
  if (!options.imu_topic.empty()) out.push_back(&sample_type<ImuSample>());
  if (!options.joint_topic.empty()) out.push_back(&sample_type<EncoderSample>());
  if (!options.gnss_topic.empty()) out.push_back(&sample_type<GnssSample>());
  if (!options.image_topics.empty()) out.push_back(&sample_type<ImageSample>());
  return out;
}

TopicOptions topic_options_from(const ParamSet& params, const std::string& key,
                                const std::string& verb) {
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
  options.gnss_topic = params.text("gnss_topic");
  options.max_gap_s = params.number("max_gap_s");
  check(options, key, verb);
  return options;
}

}  // namespace viwo::bag
