// gnuplot as a process: no shell between it and us.
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <thread>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "gnuplot.hpp"
#include "gnuplot_format.hpp"
#include "viwo/api/status.hpp"

namespace viwo::report {
namespace {

constexpr std::size_t kMostShown = 2000;
constexpr std::size_t kMostKept = 2 * kMostShown;

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

using Clock = std::chrono::steady_clock;

/// What comes out of a descriptor, which is closed at the end, until nothing does or time is up.
std::string read_until(int descriptor, Clock::time_point deadline) {
  std::string text;
  std::array<char, 4096> buffer{};
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    pollfd waiting{descriptor, POLLIN, 0};
    const int ready = left.count() > 0 ? poll(&waiting, 1, static_cast<int>(left.count())) : 0;
    if (ready == 0) break;
    if (ready < 0 && errno == EINTR) continue;
    const ssize_t n = read(descriptor, buffer.data(), buffer.size());
    if (n > 0) {
      text.append(buffer.data(), static_cast<std::size_t>(n));
      if (text.size() > kMostKept) text.erase(0, text.size() - kMostKept);
    } else if (n == 0 || errno != EINTR) {
      break;
    }
  }
  close(descriptor);
  return text;
}

/// How the child ended; nothing if time was up and it had to be.
std::optional<int> end_until(pid_t child, Clock::time_point deadline) {
  int status = 0;
  for (;;) {
    const pid_t ended = waitpid(child, &status, WNOHANG);
    if (ended == child) return status;
    if (ended < 0 && errno != EINTR) return 0;
    if (Clock::now() >= deadline) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  kill(-child, SIGKILL);  // and what it has begun itself
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return std::nullopt;
}

/// The end of a message, where gnuplot says what it did not like.
std::string last_part(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  if (text.size() > kMostShown) text = "..." + text.substr(text.size() - kMostShown);
  return text;
}

[[noreturn]] void throw_missing() {
  throw InputError(
      "--figures needs gnuplot, which is not in PATH: install it (apt-get install gnuplot-nox) "
      "or leave --figures out");
}

/// Standard error goes to `pipe_write`; the others to nowhere.
int spawn(const std::filesystem::path& folder, const std::string& argument, int pipe_write,
          pid_t& child) {
  SpawnActions actions;
  posix_spawn_file_actions_addopen(actions.get(), STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(actions.get(), STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(actions.get(), pipe_write, STDERR_FILENO);
  posix_spawn_file_actions_addchdir_np(actions.get(), folder.c_str());
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  // -d: without the settings of the user, or figures would differ between machines.
  std::string program = "gnuplot", defaults = "-d", last = argument;
  std::array<char*, 4> arguments{program.data(), defaults.data(), last.data(), nullptr};
  const int error =
      posix_spawnp(&child, "gnuplot", actions.get(), &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  return error;
}

}  // namespace

void run_gnuplot(const std::filesystem::path& folder, const std::string& script,
                 std::chrono::milliseconds limit) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw std::runtime_error(std::string("cannot run gnuplot: ") + std::strerror(errno));
  }
  pid_t child = 0;
  const int error = spawn(folder, script, ends[1], child);
  close(ends[1]);
  if (error != 0) {
    close(ends[0]);
    if (error == ENOENT) throw_missing();
    throw std::runtime_error(std::string("cannot run gnuplot: ") + std::strerror(error));
  }
  const auto deadline = Clock::now() + limit;
  std::string message = last_part(read_until(ends[0], deadline));
  if (!message.empty()) message.insert(0, ":\n");
  const std::optional<int> status = end_until(child, deadline);
  if (status && WIFEXITED(*status) && WEXITSTATUS(*status) == 0) return;
  // What a child says that was made, but found no program (under qemu).
  constexpr int kNotFound = 127;
  if (status && WIFEXITED(*status) && WEXITSTATUS(*status) == kNotFound) throw_missing();
  const std::string what = (folder / script).string();
  if (!status) {
    throw std::runtime_error("gnuplot was stopped: it had not finished " + what + " after " +
                             rounded(1e-3 * static_cast<double>(limit.count())) + " s" + message);
  }
  throw std::runtime_error("gnuplot failed on " + what + message);
}

void require_gnuplot() { run_gnuplot("/", "--version"); }

}  // namespace viwo::report
