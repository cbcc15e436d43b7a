#include "viwo/config/regular_file.hpp"

#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "viwo/api/status.hpp"

namespace viwo::config {
namespace {

/// What cannot be read as a file is, by its name.
void require_regular(const std::filesystem::path& file, std::filesystem::file_type type) {
  using std::filesystem::file_type;
  switch (type) {
    case file_type::directory:
      throw InputError(file.string() + "  is a folder, not a file");
    case file_type::fifo:
    case file_type::socket:
      throw InputError(file.string() + "  is a pipe, not a file");
    case file_type::character:
    case file_type::block:
      throw InputError(file.string() + "  is a device, not a file");
    default:  // whether it is there shows when it is opened
      return;
  }
}

std::filesystem::file_type type_of(int fd) {
  using std::filesystem::file_type;
  struct stat found {};
  if (::fstat(fd, &found) != 0) return file_type::unknown;
  if (S_ISDIR(found.st_mode)) return file_type::directory;
  if (S_ISFIFO(found.st_mode)) return file_type::fifo;
  if (S_ISSOCK(found.st_mode)) return file_type::socket;
  if (S_ISCHR(found.st_mode)) return file_type::character;
  if (S_ISBLK(found.st_mode)) return file_type::block;
  return file_type::regular;
}

[[noreturn]] void fail_by_errno() { throw std::system_error(errno, std::generic_category()); }

}  // namespace

void require_regular_file(const std::filesystem::path& file) {
  std::error_code ignored;
  require_regular(file, std::filesystem::status(file, ignored).type());
}

int open_regular_file(const std::filesystem::path& file) {
  require_regular_file(file);  // to open a device may do something, to open a socket cannot be done
  // By now it may be another one: what was opened is looked at, too.
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (fd < 0) return -1;
  try {
    require_regular(file, type_of(fd));
  } catch (const InputError&) {
    ::close(fd);
    throw;
  }
  const int flags = ::fcntl(fd, F_GETFL);
  if (flags >= 0 && ::fcntl(fd, F_SETFL, flags & ~O_NONBLOCK) == 0) return fd;
  const int error = errno;
  ::close(fd);
  errno = error;
  return -1;
}

RegularFile::RegularFile(const std::filesystem::path& file) : fd_(open_regular_file(file)) {
  if (fd_ < 0) fail_by_errno();
}

RegularFile::~RegularFile() { ::close(fd_); }

std::uintmax_t RegularFile::size() const {
  struct stat found {};
  if (::fstat(fd_, &found) != 0) fail_by_errno();
  return static_cast<std::uintmax_t>(found.st_size);
}

std::size_t RegularFile::read(std::span<char> into) {
  std::size_t done = 0;
  while (done < into.size()) {
    const ssize_t n = ::read(fd_, into.data() + done, into.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail_by_errno();
    if (n == 0) break;
    done += static_cast<std::size_t>(n);
  }
  return done;
}

}  // namespace viwo::config
