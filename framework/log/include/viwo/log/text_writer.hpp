// Writes text files so that no failure goes unnoticed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace viwo::log {

/// Every failure (folder missing, disk full) throws std::runtime_error "file  cannot be written:
/// reason"; close() must be called, for the last bytes may fail, too.
class TextWriter {
 public:
  explicit TextWriter(const std::filesystem::path& file);

  TextWriter& operator<<(std::string_view text);
  /// Shortest text that reads back to the same bits.
  TextWriter& operator<<(double value);
  TextWriter& operator<<(std::int64_t value);

  /// Writes what is left: it is in the file also if the process is killed.
  void flush();
  /// The same, and closes the file.
  void close();

 private:
  void check() const;

  std::filesystem::path file_;
  std::ofstream stream_;
  std::string pending_;
};

}  // namespace viwo::log
