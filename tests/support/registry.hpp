// The plugins of this build, and the configurations that are delivered with it.
#pragma once

#include <filesystem>
#include <string>

#include "viwo/plugin_host/registry.hpp"

namespace viwo::testing {

inline PluginRegistry& registry() {
  static PluginRegistry plugins({VIWO_TEST_PLUGIN_DIR});
  return plugins;
}

inline std::filesystem::path configuration(const std::string& name) {
  return std::filesystem::path(VIWO_TEST_SOURCE_DIR) / "configs" / name;
}

}  // namespace viwo::testing
