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

const bag::TopicOptions& checked(const bag::TopicOptions& topics) {
  topics.check("imu_topic", "listen to");
  std::set<std::string> seen;
  check_topic("imu_topic", topics.imu_topic, seen);
  for (const std::string& topic : topics.image_topics) check_topic("image_topics", topic, seen);
  check_topic("joint_topic", topics.joint_topic, seen);
  check_topic("pose_topic", topics.pose_topic, seen);
  check_topic("odometry_topic", topics.odometry_topic, seen);
  check_topic("gnss_topic", topics.gnss_topic, seen);
  return topics;
}

}  // namespace viwo::ros1
