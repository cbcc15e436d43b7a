// Results that take the place of those before, and files that are none.
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <string>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "in_folder.hpp"
#include "message_of.hpp"
#include "viwo/files/files.hpp"

namespace viwo::files {
namespace {

using testing::error_of;
using testing::InFolder;
using testing::text_of;

namespace fs = std::filesystem;
using ::testing::ElementsAre;

class NewResultsTest : public InFolder {
 protected:
  void SetUp() override {
    for (const char* name : {"summary.json", "report.html", "old.csv", "table.csv"}) {
      write_text(folder_ / name, "before");
    }
  }

  /// Name and text of all that is there, in the order of the names.
  std::vector<std::string> there() const {
    std::vector<std::string> files;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      files.push_back(entry.path().filename().string() + ": " +
                      (entry.is_regular_file() ? text_of(entry.path()) : "none"));
    }
    std::sort(files.begin(), files.end());
    return files;
  }
};

TEST_F(NewResultsTest, TakeTheirPlaceAndTheRestOfThoseBeforeGoes) {
  NewResults results(folder_);
  write_text(results.file("table.csv"), "new");
  write_text(results.file("summary.json"), "new");
  EXPECT_EQ(text_of(folder_ / "summary.json"), "before");
  results.commit({"summary.json", "report.html"});
  EXPECT_THAT(there(), ElementsAre("old.csv: before", "summary.json: new", "table.csv: new",
                                   "unfinished.tmp: none"));
}

TEST_F(NewResultsTest, LeaveThoseBeforeIfTheyAreNotComplete) {
  {
    NewResults results(folder_);
    write_text(results.file("summary.json"), "new");
  }
  EXPECT_THAT(there(), ElementsAre("old.csv: before", "report.html: before", "summary.json: before",
                                   "table.csv: before"));
}

TEST_F(NewResultsTest, LeaveThoseBeforeIfOneCannotTakeItsPlace) {
  fs::create_directory(folder_ / "trajectory.tum");
  fs::create_symlink("/dev/full", folder_ / "timing.csv");
  for (const std::string name : {"trajectory.tum", "timing.csv"}) {
    NewResults results(folder_);
    write_text(results.file(name.c_str()), "new");
    write_text(results.file("summary.json"), "new");
    EXPECT_EQ(error_of<std::runtime_error>([&] { results.commit({"summary.json"}); }),
              "cannot write " + (folder_ / name).string() + ": " +
                  (name == "timing.csv" ? "No space left on device" : "Is a directory"));
    EXPECT_EQ(text_of(folder_ / "summary.json"), "before");
  }
}

/// In a folder like /tmp nobody removes what is of others.
TEST_F(NewResultsTest, LeaveThoseBeforeIfTheyAreOfSomebodyElse) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root may become somebody else";
  constexpr uid_t kNobody = 65534;
  fs::permissions(folder_, fs::perms::all | fs::perms::sticky_bit);
  ASSERT_EQ(::seteuid(kNobody), 0);
  const std::string text = error_of<std::runtime_error>([&] {
    NewResults results(folder_);
    write_text(results.file("summary.json"), "new");
    write_text(results.file("trajectory.tum"), "new");
    results.commit({"summary.json", "report.html"});
  });
  ASSERT_EQ(::seteuid(0), 0);
  EXPECT_EQ(text,
            "cannot write " + (folder_ / "summary.json").string() + ": Operation not permitted");
  EXPECT_THAT(there(), ElementsAre("old.csv: before", "report.html: before", "summary.json: before",
                                   "table.csv: before"));
}

TEST_F(NewResultsTest, OfACommandThatWasKilledAreNotTakenForNew) {
  write_text(make_folder_in(folder_, "unfinished.tmp") / "table.csv", "half");
  NewResults results(folder_);
  results.commit({});
  EXPECT_EQ(text_of(folder_ / "table.csv"), "before");
}

/// Commits results that last until somebody reads from `pipe`.
[[noreturn]] void commit_slowly(const fs::path& folder) {
  try {
    std::thread([] { ::pause(); }).detach();  // who may be asked to end in place of who commits
    NewResults results(folder);
    write_text(results.file("pipe"), std::string(1 << 20, 'x'));
    write_text(results.file("summary.json"), "new");
    results.commit({"summary.json", "report.html"});
  } catch (...) {
    ::_exit(1);
  }
  ::_exit(0);
}

TEST_F(NewResultsTest, AreThereBeforeASignalEndsTheProcess) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) {
    write_text(folder_ / "summary.json", "before");
    const int reader = ::open((folder_ / "pipe").c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    ASSERT_GE(reader, 0);
    const pid_t child = ::fork();
    if (child == 0) {
      std::signal(number, SIG_DFL);  // of tests in the background some are ignored
      commit_slowly(folder_);
    }
    pollfd ready{reader, POLLIN, 0};
    EXPECT_EQ(::poll(&ready, 1, 60'000), 1);
    ::kill(child, number);
    int status = 0;
    std::array<char, 4096> bytes{};
    while (::waitpid(child, &status, WNOHANG) == 0) {
      if (::read(reader, bytes.data(), bytes.size()) <= 0) ::usleep(1000);
    }
    ::close(reader);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == number) << number << " " << status;
    EXPECT_EQ(text_of(folder_ / "summary.json"), "new") << number;
    fs::remove_all(folder_ / "unfinished.tmp");
  }
}

class RegularFileTest : public InFolder {};

TEST_F(RegularFileTest, IsOpenedToReadAndWaitedFor) {
  const fs::path file = write("file", "text");
  const int fd = config::open_regular_file(file);
  ASSERT_GE(fd, 0);
  EXPECT_EQ(::fcntl(fd, F_GETFL) & (O_ACCMODE | O_NONBLOCK), O_RDONLY);
  EXPECT_EQ(::fcntl(fd, F_GETFD) & FD_CLOEXEC, FD_CLOEXEC);
  std::array<char, 5> text{};
  EXPECT_EQ(::read(fd, text.data(), text.size()), 4);
  ::close(fd);
  EXPECT_EQ(config::open_regular_file(folder_ / "none"), -1);
  EXPECT_EQ(errno, ENOENT);
}

TEST_F(RegularFileTest, IsReadPieceByPiece) {
  config::RegularFile file(write("file", "text"));
  EXPECT_EQ(file.size(), 4U);
  std::string bytes(3, '\0');
  EXPECT_EQ(file.read(bytes), 3U);
  EXPECT_EQ(bytes, "tex");
  EXPECT_EQ(file.read(bytes), 1U);
  EXPECT_EQ(file.read(bytes), 0U);
  EXPECT_THROW(config::RegularFile(folder_ / "none"), std::system_error);
  EXPECT_THROW(config::RegularFile{folder_}, InputError);
}

TEST_F(RegularFileTest, IsNoPipeNorDeviceNorFolder) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  const auto refusal = [](const fs::path& file) {
    return error_of([&] { config::open_regular_file(file); });
  };
  EXPECT_EQ(refusal(folder_ / "pipe"), (folder_ / "pipe").string() + "  is a pipe, not a file");
  EXPECT_EQ(refusal(folder_), folder_.string() + "  is a folder, not a file");
  EXPECT_EQ(refusal("/dev/zero"), "/dev/zero  is a device, not a file");
}

/// A pipe that takes the place of a file after that was looked at has nobody wait for a writer.
TEST_F(RegularFileTest, MayBeExchangedAtAnyTime) {
  const fs::path name = folder_ / "file", file = write("a", "text"), pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  std::atomic<bool> done = false;
  std::thread exchange([&] {
    while (!done) {
      for (const fs::path& target : {file, pipe}) {
        std::error_code ignored;
        fs::create_symlink(target, folder_ / "next", ignored);
        fs::rename(folder_ / "next", name, ignored);
      }
    }
  });
  for (int i = 0; i < 20'000; ++i) {
    try {
      if (const int fd = config::open_regular_file(name); fd >= 0) ::close(fd);
    } catch (const InputError&) {
    }
  }
  done = true;
  exchange.join();
}

}  // namespace
}  // namespace viwo::files
