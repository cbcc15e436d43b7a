#include "plugin_file.hpp"

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <system_error>
#include <utility>

#include <sys/stat.h>

#include "elf.hpp"
#include "viwo/config/regular_file.hpp"
#include "viwo/plugin_host/plugin_info.hpp"

/// Of what this code is linked into; by the linker.
// NOLINTNEXTLINE(bugprone-reserved-identifier,readability-identifier-naming)
extern "C" __attribute__((visibility("hidden"))) const ElfW(Ehdr) __ehdr_start;

namespace viwo {
namespace {

constexpr std::string_view kPrefix = "libviwo_";
constexpr std::string_view kSuffix = ".so";

/// A plugin has some MB, with debug information less than a hundred. It is held twice.
constexpr std::int64_t kLargest = 200LL << 20;

/// The machine that this program is built for.
std::uint16_t own_machine() { return __ehdr_start.e_machine; }

void check_elf(const std::filesystem::path& file, const std::string& bytes) {
  if (bytes.size() < EI_NIDENT || std::memcmp(bytes.data(), ELFMAG, SELFMAG) != 0) {
    throw PluginRefused(file, "is not a shared library - a plugin is built with viwo_add_plugin()");
  }
  const char elf_class = sizeof(void*) == 8 ? ELFCLASS64 : ELFCLASS32;
  const std::string truncated = "is truncated - copy or build it again";
  if (bytes[EI_CLASS] != elf_class) {
    throw PluginRefused(file, "is built for another processor - rebuild it on this machine");
  }
  if (bytes.size() < sizeof(elf::Header)) throw PluginRefused(file, truncated);
  const auto header = elf::copy_at<elf::Header>(bytes, 0);
  if (header.e_machine != own_machine()) {
    throw PluginRefused(file, "is built for another processor - rebuild it on this machine");
  }
  if (header.e_type != ET_DYN) {
    throw PluginRefused(file,
                        "is not a shared library but an object file or a program - a plugin "
                        "is built with viwo_add_plugin()");
  }
  if (header.e_phentsize != sizeof(elf::Segment) ||
      !elf::fits(header.e_phoff, std::uint64_t{header.e_phnum} * sizeof(elf::Segment),
                 bytes.size())) {
    throw PluginRefused(file, truncated);
  }
  // It is at the end of the file, behind all that is loaded and the debug information.
  if (header.e_shoff != 0 &&
      !elf::fits(header.e_shoff, std::uint64_t{header.e_shnum} * header.e_shentsize,
                 bytes.size())) {
    throw PluginRefused(file, truncated);
  }
  // Linkers write a dozen; each is looked through for every search path.
  constexpr std::size_t kMostSegments = 64;
  if (header.e_phnum > kMostSegments) {
    throw PluginRefused(file, "is damaged: it has " + std::to_string(header.e_phnum) +
                                  " segments - copy or build it again");
  }
  std::uint64_t loaded = 0;
  for (const elf::Segment& segment : elf::segments(bytes)) {
    if (segment.p_type != PT_LOAD) continue;
    if (!elf::fits(segment.p_offset, segment.p_filesz, bytes.size())) {
      throw PluginRefused(file, truncated);
    }
    loaded += segment.p_filesz;
  }
  if (loaded > 2 * bytes.size()) {
    throw PluginRefused(file,
                        "is damaged: its segments lie over each other - copy or build it again");
  }
}

config::RegularFile open_library(const std::filesystem::path& file) {
  try {
    return config::RegularFile(file);
  } catch (const InputError&) {
    throw PluginRefused(file, "is not a regular file");
  }
}

FileVersion version_in(const struct stat& found) {
  const auto ns = [](const timespec& time) {
    return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
  };
  return {found.st_dev, found.st_ino, found.st_size, ns(found.st_mtim), ns(found.st_ctim)};
}

FileVersion version_of(const config::RegularFile& opened) {
  struct stat found {};
  if (::fstat(opened.descriptor(), &found) != 0) {
    throw std::system_error(errno, std::generic_category());
  }
  return version_in(found);
}

}  // namespace

std::optional<PluginFileName> parse_file_name(const std::filesystem::path& file) {
  const std::string text = file.filename().string();
  std::string_view rest = text;
  if (!rest.starts_with(kPrefix) || !rest.ends_with(kSuffix)) return std::nullopt;
  rest.remove_prefix(kPrefix.size());
  if (rest.size() < kSuffix.size()) return std::nullopt;
  rest.remove_suffix(kSuffix.size());
  const std::size_t bar = rest.find('_');
  if (bar == std::string_view::npos || bar == 0 || bar + 1 == rest.size()) return std::nullopt;
  return PluginFileName{std::string(rest.substr(0, bar)), std::string(rest.substr(bar + 1))};
}

std::string make_file_name(const std::string& kind, const std::string& name) {
  return std::string(kPrefix) + kind + "_" + name + std::string(kSuffix);
}

FileVersion version_of(const std::filesystem::path& file) {
  struct stat found {};
  return ::stat(file.c_str(), &found) == 0 ? version_in(found) : FileVersion{};
}

LibraryBytes read_library(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    throw PluginRefused(file, "is a folder, not a shared library");
  }
  try {
    config::RegularFile opened = open_library(file);
    const FileVersion version = version_of(opened);
    if (version.size > kLargest)
      throw PluginRefused(file, "is larger than 200 MiB, as no plugin is");
    std::string bytes(static_cast<std::size_t>(version.size), '\0');
    bytes.resize(opened.read(bytes));
    check_elf(file, bytes);
    return {std::move(bytes), version};
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::no_such_file_or_directory ||
        error.code() == std::errc::not_a_directory) {
      throw PluginRefused(file, "no such file");
    }
    const bool is_forbidden = error.code() == std::errc::permission_denied;
    throw PluginUnavailable(file, "cannot be read: " + error.code().message() +
                                      (is_forbidden ? " - check its permissions" : ""));
  }
}

}  // namespace viwo
