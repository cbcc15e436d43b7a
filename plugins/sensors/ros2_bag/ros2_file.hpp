// ROS 2 bags stored by SQLite.
#pragma once

#include <filesystem>
#include <memory>

#include "bag.hpp"

namespace viwo::bag {

/// The folder of a bag (metadata.yaml and *.db3), or one .db3. InputError for what cannot be read,
/// also for bags that are compressed or stored otherwise.
std::shared_ptr<const Bag> open_ros2(const std::filesystem::path& path);

}  // namespace viwo::bag
