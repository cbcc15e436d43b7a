#include "topic_names.hpp"

#include <set>

#include <ros/names.h>

#include "viwo/api/status.hpp"

namespace viwo::ros1 {
namespace {

void check_topic(const std::string& key, const std::string& topic, std::set<std::string>& seen) {
  if (topic.empty()) return;
  check_name(key, topic);
  if (!seen.insert(topic).second) throw ParamError(key, "'" + topic + "' is wanted twice");
}

}  // namespace

void check_name(const std::string& key, const std::string& topic) {
  std::string error;
  if (topic.empty() || !ros::names::validate(topic, error)) {
    throw ParamError(key, "'" + topic + "' cannot be the name of a topic: " + error);
  }
}

bag::TopicOptions options_from(const ParamSet& params) {
  bag::TopicOptions options = bag::topic_options_from(params, "imu_topic", "listen to");
  std::set<std::string> seen;
  check_topic("imu_topic", options.imu_topic, seen);
  for (const std::string& topic : options.image_topics) check_topic("image_topics", topic, seen);
  check_topic("joint_topic", options.joint_topic, seen);
  check_topic("pose_topic", options.pose_topic, seen);
  check_topic("odometry_topic", options.odometry_topic, seen);
  check_topic("gnss_topic", options.gnss_topic, seen);
  return options;
}

}  // namespace viwo::ros1
