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
#include "viwo/api/status.hpp"

namespace viwo::log {

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

/// The text of the exception that `f` throws; empty when it throws none.
template <class Exception = InputError, class F>
std::string message_of(F&& f) {
  try {
    f();
  } catch (const Exception& error) {
    return error.what();
  }
  return {};
}

}  // namespace viwo::log
