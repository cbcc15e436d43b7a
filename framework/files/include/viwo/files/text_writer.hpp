// Writes text files so that no failure goes unnoticed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "viwo/files/files.hpp"

namespace viwo::files {

/// Every failure (folder missing, disk full) throws std::runtime_error "cannot write FILE: reason";
/// close() must be called, for the last bytes may fail, too.
class TextWriter {
 public:
  explicit TextWriter(const std::filesystem::path& file, Appears appears = Appears::kWhole)
      : file_(file, appears) {}

  /// What is not UTF-8 becomes U+FFFD, as by write_text().
  TextWriter& operator<<(std::string_view text);
  /// Shortest text that reads back to the same bits.
  TextWriter& operator<<(double value);
  TextWriter& operator<<(std::int64_t value);

  /// Hands on what is left.
  void flush();
  /// The same, and ends the file.
  void close();

 private:
  FileWriter file_;
  std::string pending_;
};

}  // namespace viwo::files
