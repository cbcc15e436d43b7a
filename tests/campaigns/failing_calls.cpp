// To be preloaded: the n-th call that changes something below a folder fails, or the machine loses
// its power there. Calls are counted over all threads.
//   FAILING_FOLDER=DIR   whose files and folders count
//   FAILING_CALL=N       1, 2, ...; 0: none, only counted
//   FAILING_HOW=disk     it returns "No space left on device"
//               power    what was written and not synced is lost, and the process with it
//   FAILING_COUNT=FILE   gets the number of calls at the end
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <string>

#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

namespace {

template <class F>
F real(const char* name) {
  return reinterpret_cast<F>(dlsym(RTLD_NEXT, name));
}

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

struct State {
  const std::string folder = variable("FAILING_FOLDER"), how = variable("FAILING_HOW"),
                    count_file = variable("FAILING_COUNT");
  const long fails = std::atol(variable("FAILING_CALL").c_str());
  std::mutex mutex;
  long calls = 0;
  std::map<int, std::string> open;         // files below the folder
  std::map<std::string, bool> not_synced;  // by what they are called now

  ~State() {
    if (count_file.empty()) return;
    if (std::FILE* out = std::fopen(count_file.c_str(), "w")) {
      std::fprintf(out, "%ld\n", calls);
      std::fclose(out);
    }
  }
};

State& state() {
  static State* const kState = new State;  // others may still write while the process ends
  return *kState;
}

__attribute__((destructor)) void say_count() { state().~State(); }

bool counts(const char* path) {
  const State& s = state();
  return path != nullptr && !s.folder.empty() && std::string(path).rfind(s.folder, 0) == 0;
}

/// One more call; whether it is to fail, which is said. The mutex is held.
bool is_to_fail(const char* call, const std::string& path) {
  State& s = state();
  if (++s.calls != s.fails) return false;
  std::fprintf(stderr, "%s of %s fails\n", call, path.c_str());
  if (s.how == "power") {
    for (const auto& [file, lost] : s.not_synced) {
      if (lost && truncate(file.c_str(), 0) != 0) continue;
    }
    kill(getpid(), SIGKILL);
    pause();
  }
  errno = ENOSPC;
  return true;
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  static const auto kReal = real<int (*)(const char*, int, ...)>("open");
  if (!counts(path) || (flags & (O_CREAT | O_DIRECTORY)) == 0) return kReal(path, flags, mode);
  State& s = state();
  const std::scoped_lock lock(s.mutex);
  if (is_to_fail("open", path)) return -1;
  const int fd = kReal(path, flags, mode);
  if (fd >= 0) s.open[fd] = path;
  return fd;
}

int open64(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  return open(path, flags, mode);
}

ssize_t write(int fd, const void* bytes, size_t size) {
  static const auto kReal = real<ssize_t (*)(int, const void*, size_t)>("write");
  State& s = state();
  const std::scoped_lock lock(s.mutex);
  const auto file = s.open.find(fd);
  if (file == s.open.end()) return kReal(fd, bytes, size);
  if (is_to_fail("write", file->second)) return -1;
  s.not_synced[file->second] = true;
  return kReal(fd, bytes, size);
}

int fsync(int fd) {
  static const auto kReal = real<int (*)(int)>("fsync");
  State& s = state();
  const std::scoped_lock lock(s.mutex);
  const auto file = s.open.find(fd);
  if (file == s.open.end()) return kReal(fd);
  if (is_to_fail("fsync", file->second)) return -1;
  if (const auto lost = s.not_synced.find(file->second); lost != s.not_synced.end()) {
    lost->second = false;
  }
  return kReal(fd);
}

int close(int fd) {
  static const auto kReal = real<int (*)(int)>("close");
  State& s = state();
  const std::scoped_lock lock(s.mutex);
  const auto file = s.open.find(fd);
  if (file == s.open.end()) return kReal(fd);
  // That of a folder, or of a file that is nothing new, tells nothing.
  const bool fails = s.not_synced.count(file->second) != 0 && is_to_fail("close", file->second);
  s.open.erase(file);
  const int result = kReal(fd);
  if (!fails) return result;
  errno = ENOSPC;
  return -1;
}

int rename(const char* from, const char* to) {
  static const auto kReal = real<int (*)(const char*, const char*)>("rename");
  State& s = state();
  const std::scoped_lock lock(s.mutex);
  if (counts(to) && is_to_fail("rename", to)) return -1;
  const int result = kReal(from, to);
  if (result == 0 && s.not_synced.count(from) != 0) {
    s.not_synced[to] = s.not_synced[from];
    s.not_synced.erase(from);
  }
  return result;
}

int mkdir(const char* path, mode_t mode) {
  static const auto kReal = real<int (*)(const char*, mode_t)>("mkdir");
  const std::scoped_lock lock(state().mutex);
  if (counts(path) && is_to_fail("mkdir", path)) return -1;
  return kReal(path, mode);
}

int unlinkat(int folder, const char* path, int flags) {
  static const auto kReal = real<int (*)(int, const char*, int)>("unlinkat");
  const std::scoped_lock lock(state().mutex);
  char name[PATH_MAX + 1] = {};
  const std::string link = "/proc/self/fd/" + std::to_string(folder);
  const bool is_ours = folder == AT_FDCWD
                           ? counts(path)
                           : readlink(link.c_str(), name, PATH_MAX) > 0 && counts(name);
  if (is_ours && is_to_fail("unlink", path)) return -1;
  return kReal(folder, path, flags);
}

}  // extern "C"
