// Bytes of a file, plain or gzipped.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

namespace viwo::log {

class ByteReader {
 public:
  /// InputError "file  what" when it cannot be read or is a folder.
  explicit ByteReader(const std::filesystem::path& file);

  /// The next bytes, at most `size`; how many they are. None at the end, and where the rest cannot
  /// be read: fault() says why then. That is also where gzip data have become far longer than those
  /// of a recording do, and where something else than gzip data (or zeros) is behind them.
  std::size_t read(char* into, std::size_t size);

  const std::string& fault() const { return fault_; }
  bool truncated() const { return truncated_; }  ///< the fault: the gzip data end early

 private:
  struct Source;
  struct Closer {
    void operator()(Source* source) const;
  };

  std::size_t read_plain(char* into, std::size_t size);
  std::size_t inflate(char* into, std::size_t size);
  bool begin_member();

  std::unique_ptr<Source, Closer> source_;
  std::string fault_;
  bool truncated_ = false;
};

}  // namespace viwo::log
