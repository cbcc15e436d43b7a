#include "topic_options.hpp"

#include <set>
#include <string>

#include "viwo/api/measurement.hpp"
#include "viwo/api/status.hpp"
#include "viwo/asl/asl.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo::bag {

void TopicOptions::check(const std::string& key, const std::string& verb) const {
  log::check_names("image_topics", image_topics, log::kMaxCamera + 1);
  log::check_names("drive_joints", drive_joints, kMaxDrives);
  log::check_names("steer_joints", steer_joints, kMaxSteers);
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
  joint_map();
  require_each_once();
  if (!pose_topic.empty() && !odometry_topic.empty()) {
    throw ParamError("odometry_topic",
                     "pose_topic and odometry_topic both give poses, which could not be told "
                     "apart: make two sensors of them");
  }
}

void TopicOptions::require_each_once() const {
  std::set<std::string> seen;
  const auto add = [&](const char* key, const std::string& topic, const char* advice = "") {
    if (topic.empty() || seen.insert(topic).second) return;
    throw ParamError(key, "'" + topic + "' is wanted twice" + advice);
  };
  constexpr const char* kTwoSensors =
      ": of an Odometry that is to give both twist and poses make two sensors";
  add("imu_topic", imu_topic);
  for (const std::string& topic : image_topics) add("image_topics", topic);
  add("joint_topic", joint_topic);
  add("pose_topic", pose_topic, kTwoSensors);
  add("odometry_topic", odometry_topic, kTwoSensors);
  add("gnss_topic", gnss_topic);
}

log::JointMap TopicOptions::joint_map() const {
  return {*this, static_cast<int>(drive_joints.size()), static_cast<int>(steer_joints.size()),
          drive_is_angle(), max_gap_s};
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
