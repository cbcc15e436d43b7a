// Folders and doctored copies for the tests of the plugin host.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

#include "in_folder.hpp"
#include "message_of.hpp"

namespace viwo {

inline const std::filesystem::path kBadPlugins =
    std::filesystem::path(VIWO_TEST_BINARY_DIR) / "tests/plugins_bad";

using testing::error_of;
using testing::text_of;
using FolderTest = testing::InFolder;

/// `text` with every `from` replaced; there must be one.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  for (; at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

}  // namespace viwo
