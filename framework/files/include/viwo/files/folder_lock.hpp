// A folder of results belongs to one program at a time, or to shards that share it.
#pragma once

#include <filesystem>

namespace viwo::files {

/// Held until it goes, also when the process is killed. File systems without locks have none.
class FolderLock {
 public:
  /// InputError where somebody else holds it, and not both share it; std::runtime_error where it
  /// cannot be opened or locked.
  FolderLock(const std::filesystem::path& folder, bool shared);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_;
};

}  // namespace viwo::files
