// A file that is read at any place.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace viwo::bag {

/// May be used by several threads at once. InputError "file  cannot be read: why".
class FileBytes {
 public:
  explicit FileBytes(std::string name);
  ~FileBytes();
  FileBytes(const FileBytes&) = delete;
  FileBytes& operator=(const FileBytes&) = delete;

  const std::string& name() const { return name_; }
  std::uint64_t size() const { return size_; }
  /// Fills all of `out`.
  void read(std::uint64_t at, std::span<std::uint8_t> out) const;

 private:
  [[noreturn]] void fail(const std::string& why) const;

  std::string name_;
  int fd_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace viwo::bag
