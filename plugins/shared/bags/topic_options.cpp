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

}  // namespace

void TopicOptions::check(const std::string& key, const std::string& verb) const {
  check_list("image_topics", image_topics, log::kMaxCamera + 1);
  check_list("drive_joints", drive_joints, kMaxDrives);
  check_list("steer_joints", steer_joints, kMaxSteers);
  if (imu_topic.empty() && image_topics.empty() && joint_topic.empty() && pose_topic.empty() &&
      odometry_topic.empty() && gnss_topic.empty()) {
    throw ParamError(key, "nothing to " + verb +
                              ": give one of imu_topic, image_topics, joint_topic, "
                              "pose_topic, odometry_topic, gnss_topic");
  }
  if (!joint_topic.empty() && drive_joints.empty()) {
    throw ParamError("joint_topic", "a joint_topic needs drive_joints, the names of the wheels");
  }
  if (joint_topic.empty() && !(drive_joints.empty() && steer_joints.empty())) {
    throw ParamError(drive_joints.empty() ? "steer_joints" : "drive_joints",
                     "names of joints need the joint_topic that they are on");
  }
  if (!pose_topic.empty() && !odometry_topic.empty()) {
    throw ParamError("odometry_topic",
                     "pose_topic and odometry_topic both give poses, which could not be told "
                     "apart: make two sensors of them");
  }
}

SampleTypes kinds_of(const TopicOptions& topics) {
  SampleTypes out;
  const bool any_pose = !topics.pose_topic.empty() || !topics.odometry_topic.empty();
  if (any_pose) out.push_back(&sample_type<PoseSample>());
  if (!topics.imu_topic.empty()) out.push_back(&sample_type<ImuSample>());
  if (!topics.joint_topic.empty()) out.push_back(&sample_type<EncoderSample>());
  if (!topics.gnss_topic.empty()) out.push_back(&sample_type<GnssSample>());
  if (!topics.image_topics.empty()) out.push_back(&sample_type<ImageSample>());
  return out;
}

}  // namespace viwo::bag
