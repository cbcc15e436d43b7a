// A plugin's library that passed every check.
#pragma once

#include <filesystem>
#include <memory>

#include <boost/dll/shared_library.hpp>

#include "plugin_file.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/plugin_host/plugin_info.hpp"

namespace viwo {

class Library {
 public:
  /// Compares build record and digest, loads the file if it is still the same, copies it to memory,
  /// checks its descriptor. Throws PluginRefused.
  explicit Library(const std::filesystem::path& file);

  const PluginInfo& info() const { return info_; }
  const PluginDescriptor& descriptor() const { return *descriptor_; }

 private:
  /// Whether nothing else in this process has loaded it before.
  bool load(const std::filesystem::path& file, const FileVersion& version);
  void find_descriptor(const std::filesystem::path& file);
  void keep_pages(const std::filesystem::path& file) const;
  void check_descriptor(const std::filesystem::path& file) const;

  boost::dll::shared_library library_;
  const PluginDescriptor* descriptor_ = nullptr;
  PluginInfo info_;
};

/// Keeps a library loaded until the process exits, whatever becomes of registries and objects:
/// vtables, texts and exception types of a plugin may be in use anywhere.
void keep_until_exit(std::shared_ptr<const Library> library);

}  // namespace viwo
