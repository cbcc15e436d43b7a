// Files of the commands, told from each other, and files that their keys name.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "viwo/config/node.hpp"

namespace viwo::config {

/// Throws InputError for a file that another command takes than `command` ("run", "experiment",
/// "calibrate", "plan"); what is no file of any is not told here.
void require_file_of(std::string_view command, const Node& file);

/// InputError at the value `node` of `key`, which names the file, where that is not there.
void require_file_of_key(const std::string& key, const Node& node,
                         const std::filesystem::path& file);

}  // namespace viwo::config
