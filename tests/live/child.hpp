// Other programs as a test needs them: in a group of their own that does not outlive the test, what
// they print in a file.
#pragma once

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace viwo::testing {

class Child {
 public:
  /// Starts `words`; its output goes to the file `output`.
  Child(std::vector<std::string> words, const std::string& output) {
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const pid_t test = getpid();
    id_ = fork();
    if (id_ != 0) return;
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);  // should the test crash
    const int file = open(output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    if (getppid() != test || file < 0 || dup2(file, STDOUT_FILENO) < 0 ||
        dup2(file, STDERR_FILENO) < 0) {
      _exit(126);
    }
    execvp(argv[0], argv.data());
    _exit(127);
  }
  ~Child() { end(); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Its exit code; -1 if it has not ended after `timeout`, or by a signal.
  int wait(std::chrono::milliseconds timeout) {
    const auto deadline = std::chrono::steady_clock::now() + timeout;
    while (id_ > 0) {
      int status = 0;
      if (waitpid(id_, &status, WNOHANG) == id_) {
        id_ = -1;
        code_ = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
        break;
      }
      if (std::chrono::steady_clock::now() > deadline) return -1;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return code_;
  }

  void signal(int number) const {
    if (id_ > 0) kill(id_, number);
  }

  /// Asks it, and all that it has started, to end; makes them if they do not.
  void end() {
    if (id_ <= 0) return;
    const pid_t group = id_;
    kill(-group, SIGTERM);
    if (wait(std::chrono::seconds(5)) < 0 && id_ > 0) {
      kill(-group, SIGKILL);
      wait(std::chrono::seconds(5));
    }
  }

 private:
  pid_t id_ = -1;
  int code_ = -1;
};

}  // namespace viwo::testing
