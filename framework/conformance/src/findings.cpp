#include "findings.hpp"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <stdexcept>

#include <sys/wait.h>
#include <unistd.h>

#include "viwo/files/time_limit.hpp"

namespace viwo::conformance {
namespace {

constexpr char kFailure = 'F';
constexpr char kNote = 'N';
constexpr char kWarning = 'W';
constexpr char kSkipped = 'S';

/// What the child has to say, each text with its kind in front and a zero behind.
std::string packed(const Findings& findings) {
  std::string bytes;
  for (const std::string& text : findings.failures()) bytes += kFailure + text + '\0';
  for (const std::string& text : findings.notes()) bytes += kNote + text + '\0';
  for (const std::string& text : findings.warnings()) bytes += kWarning + text + '\0';
  if (!findings.skipped().empty()) bytes += kSkipped + findings.skipped() + '\0';
  return bytes;
}

void unpack(const std::string& bytes, CheckResult& result) {
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t end = std::min(bytes.find('\0', at), bytes.size());
    const std::string text = bytes.substr(at + 1, end - at - 1);
    switch (bytes[at]) {
      case kFailure:
        result.failures.push_back(text);
        break;
      case kWarning:
        result.warnings.push_back(text);
        break;
      case kSkipped:
        result.skipped = text;
        break;
      default:
        result.notes.push_back(text);
    }
    at = end + 1;
  }
}

void write_all(int file, const std::string& bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t written = ::write(file, bytes.data() + at, bytes.size() - at);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;
    at += static_cast<std::size_t>(written);
  }
}

std::string read_all(int file) {
  std::string bytes;
  char buffer[4096];
  for (;;) {
    const ssize_t n = ::read(file, buffer, sizeof(buffer));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return bytes;
    bytes.append(buffer, static_cast<std::size_t>(n));
  }
}

/// The child's whole life. No destructors and no exit handlers: they are the parent's.
[[noreturn]] void run_child(int out, int time_limit_s, const Check& check) {
  files::end_after(static_cast<unsigned>(time_limit_s));
  Findings findings;
  try {
    check(findings);
  } catch (const std::exception& error) {
    findings.fail(std::string("ended with an exception: ") + error.what());
  } catch (...) {
    findings.fail("ended with something thrown that is not a std::exception");
  }
  write_all(out, packed(findings));
  ::close(out);
  ::_exit(0);
}

std::string end_of(int status, int time_limit_s) {
  if (WIFEXITED(status)) {
    const int code = WEXITSTATUS(status);
    return code == 0 ? "" : "the plugin ended the process with exit code " + std::to_string(code);
  }
  const int signal = WTERMSIG(status);
  if (signal == SIGALRM) {
    return "took longer than " + std::to_string(time_limit_s) +
           " s: a call of the plugin does not return";
  }
  return "crashed: " + std::string(::strsignal(signal)) +
         " - run it under a debugger, or build plugin and host with "
         "VIWO_SANITIZE=address,undefined";
}

}  // namespace

CheckResult run_apart(const std::string& name, int time_limit_s, const Check& check) {
  CheckResult result;
  result.name = name;
  int ends[2];
  if (::pipe(ends) != 0) throw std::runtime_error("no pipe: " + std::string(std::strerror(errno)));
  std::fflush(nullptr);  // what waits in a buffer would be written by both processes
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("no process: " + std::string(std::strerror(errno)));
  if (child == 0) {
    ::close(ends[0]);
    run_child(ends[1], time_limit_s, check);
  }
  ::close(ends[1]);
  unpack(read_all(ends[0]), result);
  ::close(ends[0]);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  const std::string end = end_of(status, time_limit_s);
  if (!end.empty()) result.failures.push_back(end);
  return result;
}

}  // namespace viwo::conformance
