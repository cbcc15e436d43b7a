// Who may write into a folder of results.
#include <filesystem>

#include <gtest/gtest.h>

#include "viwo/api/status.hpp"
#include "viwo/files/folder_lock.hpp"

namespace viwo::files {
namespace {

namespace fs = std::filesystem;

TEST(FolderLock, IsOfOneOrOfShards) {
  const fs::path folder = fs::path(::testing::TempDir()) / "viwo_folder_lock";
  fs::create_directories(folder);
  {
    const FolderLock shard(folder, true);
    const FolderLock another(folder, true);
    EXPECT_THROW(FolderLock(folder, false), InputError);
  }
  {
    const FolderLock whole(folder, false);
    EXPECT_THROW(FolderLock(folder, true), InputError);
    EXPECT_THROW(FolderLock(folder, false), InputError);
  }
  const FolderLock again(folder, false);
}

}  // namespace
}  // namespace viwo::files
