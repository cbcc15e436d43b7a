// What is there and can be read as a file.
#pragma once

#include <filesystem>
#include <string>

#include "viwo/config/node.hpp"

namespace viwo::config {

/// InputError "file  is a pipe, not a file" for what is there and cannot be read as one: folders,
/// pipes, whose reader waits for ever, and devices, which may have no end.
void require_regular_file(const std::filesystem::path& file);

/// InputError at the value `node` of `key`, which names the file, where that is not there.
void require_file_of_key(const std::string& key, const Node& node,
                         const std::filesystem::path& file);

}  // namespace viwo::config
