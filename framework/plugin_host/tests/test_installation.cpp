// Which copy of a plugin is loaded.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "support.hpp"
#include "viwo/plugin_host/installation.hpp"
#include "viwo/plugin_host/registry.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

using FasterCopy = FolderTest;

TEST_F(FasterCopy, OfAPluginIsLoadedOnThisProcessorUnlessToldNotTo) {
  std::vector<std::string_view> sets = faster_instruction_sets();
  if (sets.empty()) GTEST_SKIP() << "this processor takes no faster copies";
  const std::string name = "libviwo_kinematics_moody.so";
  fs::copy_file(kBadPlugins / name, folder_ / name);
  EXPECT_EQ(PluginRegistry({folder_}).find("kinematics", "moody").file, folder_ / name);
  // The slowest first: each that is there is taken before those that were there.
  std::reverse(sets.begin(), sets.end());
  for (const std::string_view set : sets) {
    fs::create_directory(folder_ / set);
    fs::copy_file(kBadPlugins / name, folder_ / set / name);
    EXPECT_EQ(PluginRegistry({folder_}).find("kinematics", "moody").file, folder_ / set / name);
  }
  ::setenv("VIWO_NO_FASTER_COPY", "1", 1);
  EXPECT_EQ(PluginRegistry({folder_}).find("kinematics", "moody").file, folder_ / name);
  ::unsetenv("VIWO_NO_FASTER_COPY");
}

}  // namespace
}  // namespace viwo
