// A plugin as a file: its name and its bytes.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace viwo {

/// What the name libviwo_<kind>_<name>.so says.
struct PluginFileName {
  std::string kind;
  std::string name;
};
std::optional<PluginFileName> parse_file_name(const std::filesystem::path& file);

std::string make_file_name(const std::string& kind, const std::string& name);

/// The bytes of a shared library for this machine. Throws PluginRefused for anything else,
/// truncated libraries included: mapping one of those would end the process with a SIGBUS.
std::string read_library_bytes(const std::filesystem::path& file);

}  // namespace viwo
