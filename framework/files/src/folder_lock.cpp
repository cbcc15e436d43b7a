#include "viwo/files/folder_lock.hpp"

#include <cerrno>
#include <stdexcept>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "viwo/api/status.hpp"

namespace viwo::files {

FolderLock::FolderLock(const std::filesystem::path& folder, bool shared)
    : fd_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (fd_ < 0) {
    throw std::runtime_error("cannot open the folder " + folder.string() + ": " +
                             std::generic_category().message(errno));
  }
  if (::flock(fd_, (shared ? LOCK_SH : LOCK_EX) | LOCK_NB) == 0) return;
  const int error = errno;
  if (error == ENOLCK || error == ENOSYS || error == EOPNOTSUPP) return;
  ::close(fd_);
  if (error == EWOULDBLOCK) {
    throw InputError("another viwo is at work in " + folder.string() +
                     (shared ? ", and not as a shard" : "") + ": wait until it is done");
  }
  throw std::runtime_error("cannot lock the folder " + folder.string() + ": " +
                           std::generic_category().message(error));
}

FolderLock::~FolderLock() { ::close(fd_); }

}  // namespace viwo::files
