#include "viwo/log/files.hpp"

#include <cerrno>
#include <cstdio>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

namespace viwo::log {

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw std::runtime_error("cannot create the folder " + folder.string() + ": " +
                             error.message());
  }
}

namespace {

/// Closed in any case.
class Descriptor {
 public:
  Descriptor(const std::filesystem::path& path, int flags)
      : fd_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  bool is_open() const { return fd_ >= 0; }

  bool write(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return true;
  }

  /// Not all file systems can for folders, nor all files that are none.
  bool sync() const { return ::fsync(fd_) == 0 || errno == EINVAL || errno == EROFS; }

  /// What is written late may fail late.
  bool close() { return ::close(std::exchange(fd_, -1)) == 0; }

 private:
  int fd_;
};

}  // namespace

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::path unfinished = file;
  unfinished += ".tmp";
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  Descriptor out(unfinished, O_WRONLY | O_CREAT | O_TRUNC);
  if (out.is_open() && out.write(text) && out.sync() && out.close() &&
      ::rename(unfinished.c_str(), file.c_str()) == 0) {
    const Descriptor in(folder, O_RDONLY | O_DIRECTORY);
    if (in.is_open() && in.sync()) return;
  }
  const int error = errno;
  ::unlink(unfinished.c_str());
  throw std::runtime_error("cannot write " + file.string() + ": " +
                           std::generic_category().message(error));
}

}  // namespace viwo::log
