// The records of a WPILOG file (WPILib's data log, version 1), one after the other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/log/byte_reader.hpp"

namespace viwo::wpilog {

/// Longer payloads are passed over: what is read here has some hundred bytes.
inline constexpr std::uint32_t kMaxPayload = 1U << 20;

struct Record {
  std::uint32_t entry = 0;   ///< 0: a control record
  std::int64_t t_us = 0;     ///< since whatever the writer says
  std::int64_t offset = 0;   ///< of its first byte in the file, decompressed
  std::uint32_t size = 0;    ///< of the payload
  std::string_view payload;  ///< until the next call; empty when it is longer than kMaxPayload
};

class LogFile {
 public:
  /// Opens a plain or gzipped file and reads its header. InputError when that is none.
  explicit LogFile(const std::filesystem::path& file);

  /// The next record; false at the end, where the file is cut short, and where no record stands.
  /// InputError for gzip data that are corrupt.
  bool next(Record& out);
  /// Why there is no next record although bytes are left: "log cut short", ...; nullptr at the end.
  const char* fault() const { return fault_; }
  std::int64_t offset() const { return record_; }  ///< of the record read last, or of the fault

  /// "name: byte 17", without folders.
  std::string where(std::int64_t offset) const;
  const std::filesystem::path& file() const { return file_; }

 private:
  /// As many as there are, at most `size`.
  std::size_t take(char* into, std::size_t size);
  bool pass_over(std::uint64_t size);
  bool stop(const char* fault);
  void read_header();

  std::filesystem::path file_;
  log::ByteReader bytes_;
  std::vector<char> payload_;
  std::int64_t offset_ = 0;  ///< of the next byte
  std::int64_t record_ = 0;
  const char* fault_ = nullptr;
};

/// `size` <= 8 bytes, the least significant first.
std::uint64_t little_endian(const char* bytes, std::size_t size);

}  // namespace viwo::wpilog
