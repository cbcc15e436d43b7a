// Whether the records of a ROS 1 bag are what they say: rosbag_storage trusts the lengths and
// places in them, and ends the program where they are wrong.
#pragma once

#include <cstdint>
#include <string>

namespace viwo::bag {

/// Follows all records of a bag of format 2.0, those in compressed chunks, too. InputError for a
/// file that is no such bag, that was cut short, has no index, or is damaged; also where chunks
/// become larger than those of recordings do (128 MiB each, 64 MiB and 100 times the file
/// together), and where their messages alternate so that they would be decompressed for minutes.
/// Returns how many bytes its chunks have, decompressed.
std::uint64_t check_structure(const std::string& file);

}  // namespace viwo::bag
