// Topics as names in ROS.
#pragma once

#include <string>

#include "topic_options.hpp"

namespace viwo::ros1 {

/// ParamError for what cannot be the name of a topic.
void check_name(const std::string& key, const std::string& topic);

/// `topics`; ParamError for names that are none in ROS, for topics that are wanted twice and for
/// parameters that contradict each other.
const bag::TopicOptions& checked(const bag::TopicOptions& topics);

}  // namespace viwo::ros1
