// Folders and whole files. What cannot be written completely is an error (std::runtime_error),
// never a silent loss.
#pragma once

#include <filesystem>
#include <string>

namespace viwo::log {

void make_folder(const std::filesystem::path& folder);

/// All of it or nothing new is there under the name, also after a loss of power: FILE.tmp is on the
/// disk before it takes the name. std::runtime_error with the reason.
void write_text(const std::filesystem::path& file, const std::string& text);

}  // namespace viwo::log
