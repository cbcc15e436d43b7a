// What is there and can be read as a file.
#pragma once

#include <filesystem>

namespace viwo::config {

/// InputError "file  is a pipe, not a file" for what is there and cannot be read as one: folders,
/// pipes, whose reader waits for ever, and devices, which may have no end.
void require_regular_file(const std::filesystem::path& file);

}  // namespace viwo::config
