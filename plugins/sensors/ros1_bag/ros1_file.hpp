// ROS 1 bags, by rosbag_storage.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "bag.hpp"

namespace viwo::bag {

/// A bag or, of a folder, the bags `names` in it, one after the other; without names all *.bag in
/// the order in which they begin. InputError, ParamError (keys path, paths).
std::shared_ptr<const Bag> open_ros1(const std::filesystem::path& path,
                                     const std::vector<std::string>& names);

}  // namespace viwo::bag
