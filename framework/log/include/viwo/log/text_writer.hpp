// Writes text files so that no failure goes unnoticed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>

#include "viwo/log/files.hpp"

namespace viwo::log {

/// When what is written is under the name of the file.
enum class Appears {
  kWhole,   ///< when it is closed, all of it (WholeFile)
  kAtOnce,  ///< as it is flushed: what has been stays when the process is killed
};

/// Every failure (folder missing, disk full) throws std::runtime_error "cannot write FILE: reason";
/// close() must be called, for the last bytes may fail, too.
class TextWriter {
 public:
  explicit TextWriter(const std::filesystem::path& file, Appears appears = Appears::kWhole);

  TextWriter& operator<<(std::string_view text);
  /// Shortest text that reads back to the same bits.
  TextWriter& operator<<(double value);
  TextWriter& operator<<(std::int64_t value);

  /// Hands on what is left.
  void flush();
  /// The same, and closes the file.
  void close();

 private:
  void check() const;

  std::filesystem::path file_;
  std::optional<WholeFile> whole_;
  std::ofstream stream_;  ///< of one that appears at once
  std::string pending_;
};

}  // namespace viwo::log
