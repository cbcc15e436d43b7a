// Which copy of a plugin is loaded.
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "support.hpp"
#include "viwo/plugin_host/installation.hpp"
#include "viwo/plugin_host/registry.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

using FasterCopy = FolderTest;

TEST_F(FasterCopy, OfAPluginIsLoadedOnThisProcessorUnlessToldNotTo) {
  const std::string_view set = faster_instruction_set();
  if (set.empty()) GTEST_SKIP() << "this processor takes no faster copies";
  const std::string name = "libviwo_kinematics_moody.so";
  fs::copy_file(kBadPlugins / name, folder_ / name);
  EXPECT_EQ(PluginRegistry({folder_}).find("kinematics", "moody").file, folder_ / name);
  fs::create_directory(folder_ / set);
  fs::copy_file(kBadPlugins / name, folder_ / set / name);
  EXPECT_EQ(PluginRegistry({folder_}).find("kinematics", "moody").file, folder_ / set / name);
  ::setenv("VIWO_NO_FASTER_COPY", "1", 1);
  EXPECT_EQ(PluginRegistry({folder_}).find("kinematics", "moody").file, folder_ / name);
  ::unsetenv("VIWO_NO_FASTER_COPY");
}

}  // namespace
}  // namespace viwo
