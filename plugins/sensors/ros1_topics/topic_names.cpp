#include "topic_names.hpp"

#include <ros/names.h>

namespace viwo::ros1 {

std::string why_no_name(const std::string& topic) {
  std::string error;
  if (topic.empty()) return "it is empty";
  return ros::names::validate(topic, error) ? std::string() : error;
}

}  // namespace viwo::ros1
