// gnuplot as a program that is not there, fails or hangs.
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "browser.hpp"
#include "gnuplot.hpp"
#include "in_folder.hpp"
#include "message_of.hpp"
#include "sample.hpp"
#include "viwo/report/figures.hpp"

namespace viwo::report {
namespace {

/// PATH for as long as it lives.
class PathVariable {
 public:
  explicit PathVariable(const std::string& value) : before_(std::getenv("PATH")) {
    setenv("PATH", value.c_str(), 1);
  }
  ~PathVariable() { setenv("PATH", before_.c_str(), 1); }
  PathVariable(const PathVariable&) = delete;
  PathVariable& operator=(const PathVariable&) = delete;

 private:
  std::string before_;
};

TEST(GnuplotProcess, MissingIsSaidWithWhatToInstall) {
  const TemporaryFolder folder;
  const PathVariable path(folder.path().string());
  EXPECT_EQ(testing::error_of(
                [&] { write_figures(folder.path(), sample_document(), FigureFormat::kSvg); }),
            "--figures needs gnuplot, which is not in PATH: install it (apt-get install "
            "gnuplot-nox) or leave --figures out");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(GnuplotProcess, RepeatsWhatItDidNotLike) {
  const TemporaryFolder programs, folder;
  const auto program = programs.path() / "gnuplot";
  std::ofstream(program) << "#!/bin/sh\n[ \"$2\" = --version ] && exit 0\n"
                            "echo \"line 3: no such terminal\" >&2\nexit 1\n";
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  const PathVariable path(programs.path().string());
  EXPECT_EQ(testing::error_of<std::runtime_error>(
                [&] { write_figures(folder.path(), sample_document(), FigureFormat::kSvg); }),
            "gnuplot failed on " + folder.path().string() +
                "/unfinished.tmp/01_top_view_first_run.gp:\nline 3: no such terminal");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(GnuplotProcess, IsNotWaitedForWhenItHangs) {
  using namespace std::chrono_literals;
  const TemporaryFolder programs;
  const auto program = programs.path() / "gnuplot";
  const PathVariable path(programs.path().string() + ":" + std::getenv("PATH"));
  const auto error_of = [&](const std::string& body, std::chrono::milliseconds limit) {
    std::ofstream(program) << "#!/bin/sh\n" << body << "\n";
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    return testing::error_of<std::runtime_error>(
        [&] { run_gnuplot(programs.path(), "a.gp", limit); });
  };
  const auto stopped = [&](const char* limit) {
    return "gnuplot was stopped: it had not finished " + (programs.path() / "a.gp").string() +
           " after " + limit;
  };
  EXPECT_EQ(error_of("exec sleep 100", 200ms), stopped("0.2 s"));
  EXPECT_EQ(error_of("exec 2>/dev/null; exec sleep 100", 200ms), stopped("0.2 s"));
  EXPECT_TRUE(error_of("while :; do echo much >&2; done", 200ms).starts_with(stopped("0.2 s")));
  // Whoever holds its standard error is not waited for either. A busy machine, too, begins a shell
  // in these seconds.
  const auto child = programs.path() / "child";
  EXPECT_EQ(error_of("echo waiting >&2; sleep 100 & echo $! > " + child.string() + "; wait", 5s),
            stopped("5 s") + ":\nwaiting");
  // What it has begun itself ends with it; nobody may have waited for that yet.
  std::string id;
  std::ifstream(child) >> id;
  ASSERT_NE(id, "");
  std::ifstream stat("/proc/" + id + "/stat");
  std::string pid, name, state;
  EXPECT_TRUE(!(stat >> pid >> name >> state) || state == "Z") << state;
  EXPECT_EQ(error_of("exit 0", 60s), "");
}

}  // namespace
}  // namespace viwo::report
