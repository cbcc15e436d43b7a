// Calls that open something, and those that change the disk, which fail or lose the power.
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include "failing_calls.hpp"

namespace failing {
namespace {

struct State {
  const std::string folder = variable("FAILING_FOLDER"), how = variable("FAILING_HOW");
  std::mutex mutex;
  std::map<int, std::string> open;         // files below the folder
  std::map<std::string, bool> not_synced;  // by what they are called now
};

State& state() {
  static State* const kState = new State;  // others may still write while the process ends
  return *kState;
}

bool counts(const char* path) {
  if (!is_kind(Kind::kDisk)) return false;
  const State& s = state();
  return path != nullptr && !s.folder.empty() && std::string(path).rfind(s.folder, 0) == 0;
}

/// Fails, or the power may go instead. The mutex is held.
bool disk_fails(const char* call, const std::string& path) {
  if (!is_to_fail(Kind::kDisk, ENOSPC, call, path.c_str())) return false;
  State& s = state();
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

bool open_fails(const char* path) {
  // What the machine says of itself: libgcrypt, which videos load, aborts without it.
  if (path != nullptr && std::string_view(path).starts_with("/proc/sys/")) return false;
  return is_to_fail(Kind::kOpen, EMFILE, "open", path);
}

/// Opens a file with `call`, which gives its descriptor, and remembers it when it counts.
template <class Call>
int open_with(const char* path, bool changes, Call&& call) {
  if (open_fails(path)) return -1;
  if (!changes || !counts(path)) return call();
  State& s = state();
  const std::scoped_lock lock(s.mutex);
  if (disk_fails("open", path)) return -1;
  const int fd = call();
  if (fd >= 0) s.open[fd] = path;
  return fd;
}

template <class Stream>
std::FILE* open_stream(const char* path, const char* mode, Stream* call) {
  std::FILE* stream = nullptr;
  open_with(path, std::strpbrk(mode, "wa+") != nullptr, [&] {
    stream = call(path, mode);
    return stream != nullptr ? fileno(stream) : -1;
  });
  return stream;
}

/// The same files, where one, or the folder that they are in, is called otherwise.
std::map<std::string, bool> renamed(const std::map<std::string, bool>& files,
                                    const std::string& from, const std::string& to) {
  std::map<std::string, bool> all;
  for (const auto& [file, lost] : files) {
    const bool is_moved = file == from || file.rfind(from + "/", 0) == 0;
    if (is_moved || all.count(file) == 0)
      all[is_moved ? to + file.substr(from.size()) : file] = lost;
  }
  return all;
}

/// Writes to a file with `call`.
template <class Call>
auto write_with(int fd, Call&& call, const char* name = "write") -> decltype(call()) {
  State& s = state();
  const std::scoped_lock lock(s.mutex);
  const auto file = s.open.find(fd);
  if (file == s.open.end()) return call();
  if (disk_fails(name, file->second)) return -1;
  s.not_synced[file->second] = true;
  return call();
}

/// Changes `path` with `call`, which gives 0 when it has.
template <class Call>
int change_with(const char* name, const char* path, Call&& call) {
  const std::scoped_lock lock(state().mutex);
  if (counts(path) && disk_fails(name, path)) return -1;
  return call();
}

/// Whether the close of a file fails, which is then closed all the same. The mutex is held.
bool close_fails(int fd) {
  State& s = state();
  const auto file = s.open.find(fd);
  if (file == s.open.end()) return false;
  // That of a folder, or of a file that is nothing new, tells nothing.
  const bool fails = s.not_synced.count(file->second) != 0 && disk_fails("close", file->second);
  s.open.erase(file);
  return fails;
}

}  // namespace

void begin_on_disk() { state(); }

void end_on_disk() {
  if (state().how == "power") disk_fails("exit", "the program");
}

}  // namespace failing

extern "C" {

int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  static const auto kReal = failing::real<int (*)(const char*, int, ...)>("open");
  return failing::open_with(path, (flags & (O_CREAT | O_DIRECTORY)) != 0,
                            [&] { return kReal(path, flags, mode); });
}

std::FILE* fopen(const char* path, const char* mode) {
  static const auto kReal = failing::real<std::FILE* (*)(const char*, const char*)>("fopen");
  return failing::open_stream(path, mode, kReal);
}

DIR* opendir(const char* path) {
  static const auto kReal = failing::real<DIR* (*)(const char*)>("opendir");
  return failing::open_fails(path) ? nullptr : kReal(path);
}

int openat(int folder, const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  static const auto kReal = failing::real<int (*)(int, const char*, int, ...)>("openat");
  return failing::open_fails(path) ? -1 : kReal(folder, path, flags, mode);
}

int memfd_create(const char* name, unsigned flags) {
  static const auto kReal = failing::real<int (*)(const char*, unsigned)>("memfd_create");
  return failing::open_fails(name) ? -1 : kReal(name, flags);
}

int pipe2(int ends[2], int flags) {
  static const auto kReal = failing::real<int (*)(int*, int)>("pipe2");
  return failing::open_fails("a pipe") ? -1 : kReal(ends, flags);
}

ssize_t write(int fd, const void* bytes, size_t size) {
  static const auto kReal = failing::real<ssize_t (*)(int, const void*, size_t)>("write");
  return failing::write_with(fd, [&] { return kReal(fd, bytes, size); });
}

/// Fails where its stream is closed.
size_t fwrite(const void* bytes, size_t size, size_t count, std::FILE* stream) {
  static const auto kReal =
      failing::real<size_t (*)(const void*, size_t, size_t, std::FILE*)>("fwrite");
  failing::State& s = failing::state();
  if (failing::is_counted(failing::Kind::kDisk)) {
    const std::scoped_lock lock(s.mutex);
    if (const auto file = s.open.find(fileno(stream)); file != s.open.end()) {
      s.not_synced[file->second] = true;
    }
  }
  return kReal(bytes, size, count, stream);
}

ssize_t writev(int fd, const iovec* pieces, int count) {
  static const auto kReal = failing::real<ssize_t (*)(int, const iovec*, int)>("writev");
  return failing::write_with(fd, [&] { return kReal(fd, pieces, count); });
}

ssize_t pwrite(int fd, const void* bytes, size_t size, off_t at) {
  static const auto kReal = failing::real<ssize_t (*)(int, const void*, size_t, off_t)>("pwrite");
  return failing::write_with(fd, [&] { return kReal(fd, bytes, size, at); });
}

ssize_t sendfile(int to, int from, off_t* at, size_t size) {
  static const auto kReal = failing::real<ssize_t (*)(int, int, off_t*, size_t)>("sendfile");
  return failing::write_with(
      to, [&] { return kReal(to, from, at, size); }, "sendfile");
}

int ftruncate(int fd, off_t size) {
  static const auto kReal = failing::real<int (*)(int, off_t)>("ftruncate");
  return failing::write_with(
      fd, [&] { return kReal(fd, size); }, "ftruncate");
}

int fsync(int fd) {
  static const auto kReal = failing::real<int (*)(int)>("fsync");
  if (!failing::is_kind(failing::Kind::kDisk)) return kReal(fd);
  failing::State& s = failing::state();
  const std::scoped_lock lock(s.mutex);
  const auto file = s.open.find(fd);
  const std::string path = file != s.open.end() ? file->second : failing::path_of(fd);
  if (!failing::counts(path.c_str())) return kReal(fd);
  if (failing::disk_fails("fsync", path)) return -1;
  if (const auto lost = s.not_synced.find(path); lost != s.not_synced.end()) {
    lost->second = false;
  }
  return kReal(fd);
}

int close(int fd) {
  static const auto kReal = failing::real<int (*)(int)>("close");
  failing::State& s = failing::state();
  const std::scoped_lock lock(s.mutex);
  const bool fails = failing::close_fails(fd);
  const int result = kReal(fd);
  if (!fails) return result;
  errno = ENOSPC;
  return -1;
}

int fclose(std::FILE* stream) {
  static const auto kReal = failing::real<int (*)(std::FILE*)>("fclose");
  const std::scoped_lock lock(failing::state().mutex);
  const bool fails = failing::close_fails(fileno(stream));
  const int result = kReal(stream);
  if (!fails) return result;
  errno = ENOSPC;
  return EOF;
}

int rename(const char* from, const char* to) {
  static const auto kReal = failing::real<int (*)(const char*, const char*)>("rename");
  failing::State& s = failing::state();
  const std::scoped_lock lock(s.mutex);
  if (failing::counts(to) && failing::disk_fails("rename", to)) return -1;
  const int result = kReal(from, to);
  if (result == 0) s.not_synced = failing::renamed(s.not_synced, from, to);
  return result;
}

int mkdir(const char* path, mode_t mode) {
  static const auto kReal = failing::real<int (*)(const char*, mode_t)>("mkdir");
  return failing::change_with("mkdir", path, [&] { return kReal(path, mode); });
}

int unlink(const char* path) {
  static const auto kReal = failing::real<int (*)(const char*)>("unlink");
  return failing::change_with("unlink", path, [&] { return kReal(path); });
}

int remove(const char* path) {
  static const auto kReal = failing::real<int (*)(const char*)>("remove");
  return failing::change_with("unlink", path, [&] { return kReal(path); });
}

int unlinkat(int folder, const char* path, int flags) {
  static const auto kReal = failing::real<int (*)(int, const char*, int)>("unlinkat");
  if (!failing::is_kind(failing::Kind::kDisk)) return kReal(folder, path, flags);
  const std::scoped_lock lock(failing::state().mutex);
  const bool is_ours =
      failing::counts(folder == AT_FDCWD ? path : failing::path_of(folder).c_str());
  if (is_ours && failing::disk_fails("unlink", path)) return -1;
  return kReal(folder, path, flags);
}

// On 64 bit the same.
[[gnu::alias("open")]] int open64(const char* path, int flags, ...);
[[gnu::alias("openat")]] int openat64(int folder, const char* path, int flags, ...);
[[gnu::alias("fopen")]] std::FILE* fopen64(const char* path, const char* mode);
[[gnu::alias("pwrite")]] ssize_t pwrite64(int fd, const void* bytes, size_t size, off_t at);
[[gnu::alias("sendfile")]] ssize_t sendfile64(int to, int from, off_t* at, size_t size);
[[gnu::alias("ftruncate")]] int ftruncate64(int fd, off_t size);

}  // extern "C"
