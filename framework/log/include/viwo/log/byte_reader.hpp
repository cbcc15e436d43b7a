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
  /// of a recording do.
  std::size_t read(char* into, std::size_t size);

  const std::string& fault() const { return fault_; }
  bool truncated() const { return truncated_; }  ///< the fault: the gzip data end early

 private:
  struct Closer {
    void operator()(void* handle) const;
  };

  bool is_too_long(std::uint64_t more);

  std::string file_;
  std::uint64_t given_ = 0;               ///< bytes so far
  std::uint64_t check_at_ = 0;            ///< how many they are when it is looked at again
  std::unique_ptr<void, Closer> handle_;  ///< zlib's gzFile, which also reads what is plain
  std::string fault_;
  bool truncated_ = false;
};

}  // namespace viwo::log
