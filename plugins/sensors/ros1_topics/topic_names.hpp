// Topics as names in ROS 1.
#pragma once

#include <string>

namespace viwo::ros1 {

/// Why this cannot be the name of a topic; empty for one that can.
std::string why_no_name(const std::string& topic);

}  // namespace viwo::ros1
