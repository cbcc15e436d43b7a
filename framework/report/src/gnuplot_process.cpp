// gnuplot as a process: no shell between it and us.
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "gnuplot.hpp"
#include "viwo/api/status.hpp"

namespace viwo::report {
namespace {

/// Where the child's descriptors go, as posix_spawn wants to know it.
class SpawnActions {
 public:
  SpawnActions() { posix_spawn_file_actions_init(&actions_); }
  ~SpawnActions() { posix_spawn_file_actions_destroy(&actions_); }
  SpawnActions(const SpawnActions&) = delete;
  SpawnActions& operator=(const SpawnActions&) = delete;
  posix_spawn_file_actions_t* get() { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_{};
};

/// All that comes out of a descriptor, which is closed at the end.
std::string read_all(int descriptor) {
  std::string text;
  std::array<char, 4096> buffer{};
  for (;;) {
    const ssize_t n = read(descriptor, buffer.data(), buffer.size());
    if (n > 0) {
      text.append(buffer.data(), static_cast<std::size_t>(n));
    } else if (n == 0 || errno != EINTR) {
      break;
    }
  }
  close(descriptor);
  return text;
}

/// The end of a message, where gnuplot says what it did not like.
std::string last_part(std::string text) {
  constexpr std::size_t kMaxSize = 2000;
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  if (text.size() > kMaxSize) text = "..." + text.substr(text.size() - kMaxSize);
  return text;
}

/// Standard error goes to `pipe_write`; the others to nowhere.
int spawn(const std::filesystem::path& folder, const std::string& argument, int pipe_write,
          pid_t& child) {
  SpawnActions actions;
  posix_spawn_file_actions_addopen(actions.get(), STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(actions.get(), STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(actions.get(), pipe_write, STDERR_FILENO);
  posix_spawn_file_actions_addchdir_np(actions.get(), folder.c_str());
  // -d: without the settings of the user, or figures would differ between machines.
  std::string program = "gnuplot", defaults = "-d", last = argument;
  std::array<char*, 4> arguments{program.data(), defaults.data(), last.data(), nullptr};
  return posix_spawnp(&child, "gnuplot", actions.get(), nullptr, arguments.data(), environ);
}

}  // namespace

void run_gnuplot(const std::filesystem::path& folder, const std::string& script) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw std::runtime_error(std::string("cannot run gnuplot: ") + std::strerror(errno));
  }
  pid_t child = 0;
  const int error = spawn(folder, script, ends[1], child);
  close(ends[1]);
  if (error != 0) {
    close(ends[0]);
    if (error == ENOENT) {
      throw InputError(
          "--figures needs gnuplot, which is not in PATH: install it (apt-get install gnuplot-nox) "
          "or leave --figures out");
    }
    throw std::runtime_error(std::string("cannot run gnuplot: ") + std::strerror(error));
  }
  const std::string message = last_part(read_all(ends[0]));
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
  throw std::runtime_error("gnuplot failed on " + (folder / script).string() +
                           (message.empty() ? "" : ":\n" + message));
}

void require_gnuplot() { run_gnuplot("/", "--version"); }

}  // namespace viwo::report
