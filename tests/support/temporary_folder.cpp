// A folder for temporary files of each test program's own: tests run side by side, and one that
// writes a file of a fixed name would meet another's. Linked into every test program.
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

#include <sys/stat.h>
#include <unistd.h>

namespace {

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "viwo_test_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) std::abort();
    folder_ = pattern;
    chmod(pattern.c_str(), 0755);  // one test looks at its files as another user
    setenv("TMPDIR", folder_.c_str(), 1);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    if (getpid() != process_) return;  // a child of the test that came to its end
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

 private:
  std::filesystem::path folder_;
  pid_t process_ = getpid();
};

const TemporaryFolder kTemporaryFolder;

}  // namespace
