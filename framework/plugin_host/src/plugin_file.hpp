// A plugin as a file: its name, its bytes, and whether they are still the same.
#pragma once

#include <cstdint>
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

/// Which file is there, and when it was written last: who replaces it or writes into it makes it
/// another one. (A write within the same tick of the clock of the file system is not seen.)
struct FileVersion {
  std::uint64_t device = 0, inode = 0;
  std::int64_t size = 0, written_ns = 0, changed_ns = 0;

  bool operator==(const FileVersion&) const = default;
};

/// As the path leads now; of no file one that is no other's.
FileVersion version_of(const std::filesystem::path& file);

struct LibraryBytes {
  std::string bytes;
  FileVersion version;  ///< before they were read
};

/// Those of a shared library for this machine. Throws PluginRefused for anything else, truncated
/// libraries included: mapping one of those would end the process with a SIGBUS.
LibraryBytes read_library(const std::filesystem::path& file);

}  // namespace viwo
