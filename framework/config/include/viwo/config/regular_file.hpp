// What is there and can be read as a file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace viwo::config {

/// InputError "file  is a pipe, not a file" for what is there and cannot be read as one: folders,
/// pipes, whose reader waits for ever, and devices, which may have no end.
void require_regular_file(const std::filesystem::path& file);

/// Opens it to read: the descriptor, or -1 with errno for what cannot be opened. InputError as
/// above, of what was opened: what is put in its place meanwhile is refused, too, and nothing is
/// waited for.
int open_regular_file(const std::filesystem::path& file);

/// The same, which is read from its begin and closed. std::system_error for what cannot be opened
/// or read.
class RegularFile {
 public:
  explicit RegularFile(const std::filesystem::path& file);
  ~RegularFile();
  RegularFile(const RegularFile&) = delete;
  RegularFile& operator=(const RegularFile&) = delete;

  int descriptor() const { return fd_; }
  /// As it is now; files of the system say 0.
  std::uintmax_t size() const;
  /// How many bytes there were: less than asked for at its end alone.
  std::size_t read(std::span<char> into);

 private:
  int fd_;
};

}  // namespace viwo::config
