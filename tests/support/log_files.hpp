// Files for the tests of the log formats.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include <gtest/gtest.h>
#include <zlib.h>

#include "in_folder.hpp"
#include "message_of.hpp"

namespace viwo::log {

using testing::error_of;

class InFolder : public testing::InFolder {
 protected:
  std::filesystem::path write_gz(const std::string& name, std::string_view text) const {
    gzFile file = gzopen((folder_ / name).c_str(), "wb");
    gzwrite(file, text.data(), static_cast<unsigned>(text.size()));
    gzclose(file);
    return folder_ / name;
  }

  static std::string content(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
};

}  // namespace viwo::log
