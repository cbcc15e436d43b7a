// Whether the records of a ROS 1 bag are what they say: rosbag_storage trusts the lengths and
// places in them, and ends the program where they are wrong.
#pragma once

#include <string>

namespace viwo::bag {

/// Follows all records of a bag of format 2.0, without reading what is in the messages. InputError
/// for a file that is no such bag, that was cut short, has no index, or is damaged. In compressed
/// chunks, whose own check sums are left to rosbag_storage, places are only known to be inside.
void check_structure(const std::string& file);

}  // namespace viwo::bag
