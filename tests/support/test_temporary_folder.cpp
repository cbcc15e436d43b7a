// Test programs do not share their temporary files.
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace {

namespace fs = std::filesystem;

TEST(TemporaryFolder, IsOfThisProgramAlone) {
  const fs::path folder = fs::temp_directory_path();
  EXPECT_EQ(folder.filename().string().rfind("viwo_test_", 0), 0U) << folder;
  EXPECT_TRUE(fs::is_empty(folder));
  EXPECT_EQ(fs::path(testing::TempDir()), folder / "");
}

TEST(TemporaryFolder, OutlivesAChild) {
  const fs::path file = fs::temp_directory_path() / "file";
  std::ofstream(file) << "kept";
  const pid_t child = fork();
  if (child == 0) std::exit(0);
  ASSERT_EQ(waitpid(child, nullptr, 0), child);
  EXPECT_TRUE(fs::exists(file));
}

}  // namespace
