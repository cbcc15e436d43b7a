// Files of the commands, told from each other.
#pragma once

#include <string_view>

#include "viwo/config/node.hpp"

namespace viwo::config {

/// Throws InputError for a file that another command takes than `command` ("run", "experiment",
/// "calibrate", "plan"); what is no file of any is not told here.
void require_file_of(std::string_view command, const Node& file);

}  // namespace viwo::config
