// Files for the tests of the log formats.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <gtest/gtest.h>
#include <zlib.h>

#include "in_folder.hpp"
#include "message_of.hpp"

namespace viwo::log {

using testing::error_of;
using testing::text_of;

class InFolder : public testing::InFolder {
 protected:
  std::filesystem::path write_gz(const std::string& name, std::string_view text) const {
    gzFile file = gzopen((folder_ / name).c_str(), "wb");
    gzwrite(file, text.data(), static_cast<unsigned>(text.size()));
    gzclose(file);
    return folder_ / name;
  }
};

}  // namespace viwo::log
