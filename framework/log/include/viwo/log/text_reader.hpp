// Lines of a text file, plain or gzipped, with their numbers for error messages.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/log/byte_reader.hpp"

namespace viwo::log {

/// Reads line by line. Everything that can be wrong with the file is an InputError
/// "file:line  what"; the file name is printed as it was given.
class TextReader {
 public:
  /// Opens a plain or gzipped file; InputError when it cannot be read or is a folder.
  explicit TextReader(const std::filesystem::path& file);
  TextReader(const TextReader&) = delete;
  TextReader& operator=(const TextReader&) = delete;

  /// The next line without its line ending, valid until the next call; false at the end. InputError
  /// for an empty file, a truncated or corrupt gzip stream and a line of more than 1 MiB.
  bool next(std::string_view& line);

  /// Whether the line read last, the file's last, has no line ending.
  bool unterminated() const { return unterminated_; }
  /// For who reads the lines: the last one is incomplete, and left out.
  void leave_out_last() { last_left_out_ = true; }
  bool last_left_out() const { return last_left_out_; }

  const std::filesystem::path& file() const { return file_; }
  /// "folder/file:line"
  std::string place() const { return file_.string() + ":" + std::to_string(line_); }
  std::int64_t line_number() const { return line_; }  ///< of the line read last, from 1
  std::string where() const;  ///< "name:line" of the line read last, without folders

  /// Throws InputError "file:line  text" for the line read last.
  [[noreturn]] void fail(const std::string& text) const;

 private:
  /// Reads more into the buffer, behind what is not consumed yet; false at the end of the file.
  bool fill();

  std::filesystem::path file_;
  ByteReader bytes_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0;  ///< first byte not consumed
  std::size_t end_ = 0;    ///< behind the last byte read
  std::int64_t line_ = 0;
  bool unterminated_ = false;
  bool last_left_out_ = false;
};

}  // namespace viwo::log
