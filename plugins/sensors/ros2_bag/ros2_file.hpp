// ROS 2 bags, in MCAP or SQLite.
#pragma once

#include <filesystem>
#include <memory>

#include "bag.hpp"

namespace viwo::bag {

/// The folder of a bag (metadata.yaml and *.mcap or *.db3), or one of these files. InputError for
/// what cannot be read, also for bags that are compressed or stored otherwise.
std::shared_ptr<const Bag> open_ros2(const std::filesystem::path& path);

}  // namespace viwo::bag
