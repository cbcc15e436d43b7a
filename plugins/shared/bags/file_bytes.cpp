#include "file_bytes.hpp"

#include <cerrno>
#include <cstring>
#include <utility>

#include <unistd.h>

#include "viwo/api/status.hpp"
#include "viwo/config/regular_file.hpp"

namespace viwo::bag {

FileBytes::FileBytes(std::string name) : name_(std::move(name)) {
  fd_ = config::open_regular_file(name_);
  if (fd_ < 0) fail(std::strerror(errno));
  const off_t end = ::lseek(fd_, 0, SEEK_END);
  size_ = end > 0 ? static_cast<std::uint64_t>(end) : 0;
}

FileBytes::~FileBytes() { ::close(fd_); }

void FileBytes::fail(const std::string& why) const {
  throw InputError(name_ + "  cannot be read: " + why);
}

void FileBytes::read(std::uint64_t at, std::span<std::uint8_t> out) const {
  while (!out.empty()) {
    const ssize_t got = ::pread(fd_, out.data(), out.size(), static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(std::strerror(errno));
    if (got == 0) fail("it has become shorter");
    at += static_cast<std::uint64_t>(got);
    out = out.subspan(static_cast<std::size_t>(got));
  }
}

}  // namespace viwo::bag
