// To be preloaded: the n-th call of a kind fails, once, between the begin and the end of main().
// Calls are counted over all threads.
//   FAILING_KIND=disk    what changes something below FAILING_FOLDER: open, write, fsync, close,
//                        rename, mkdir, unlink ("No space left on device")
//                open    opens a file, a folder or a pipe, whichever ("Too many open files")
//                read    reads from a file that was opened ("Input/output error")
//                mmap    maps memory or a file ("Cannot allocate memory")
//                thread  begins a thread or a process ("Resource temporarily unavailable")
//                memory  allocates ("Cannot allocate memory")
//   FAILING_FOLDER=DIR   for the kind disk
//   FAILING_CALL=N       1, 2, ...; 0: none, only counted
//   FAILING_HOW=error    it returns an error
//               power    what was written below the folder and not synced is lost, and the process
//               with it
//   FAILING_COUNT=FILE   gets the number of calls at the end
//   FAILING_TRACE=1      shows who called
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
#include <string_view>

#include <dirent.h>
#include <dlfcn.h>
#include <execinfo.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

namespace {

template <class F>
F real(const char* name) {
  return reinterpret_cast<F>(dlsym(RTLD_NEXT, name));
}

enum class Kind { kDisk, kOpen, kRead, kMmap, kThread, kMemory };

Kind kind_of(const std::string& name) {
  if (name == "open") return Kind::kOpen;
  if (name == "read") return Kind::kRead;
  if (name == "mmap") return Kind::kMmap;
  if (name == "thread") return Kind::kThread;
  if (name == "memory") return Kind::kMemory;
  return Kind::kDisk;
}

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

// Without State, which allocates.
std::atomic<bool> counting = false;
std::atomic<long> calls = 0;
std::atomic<Kind> kind = Kind::kDisk;
long failing_call = 0;

struct State {
  const std::string folder = variable("FAILING_FOLDER"), how = variable("FAILING_HOW"),
                    trace = variable("FAILING_TRACE");
  std::mutex mutex;
  std::map<int, std::string> open;         // files below the folder
  std::map<std::string, bool> not_synced;  // by what they are called now
};

State& state() {
  static State* const kState = new State;  // others may still write while the process ends
  return *kState;
}

bool counts(const char* path) {
  if (kind != Kind::kDisk) return false;
  const State& s = state();
  return path != nullptr && !s.folder.empty() && std::string(path).rfind(s.folder, 0) == 0;
}

/// One more call; whether it is to fail, which is said.
bool is_to_fail(Kind of, int error, const char* call, const char* what) {
  if (!counting || kind != of || ++calls != failing_call) return false;
  counting = false;  // what follows is no call of the program
  std::fprintf(stderr, "failing_calls: %s of %s fails\n", call, what);
  if (!state().trace.empty()) {
    void* callers[64];
    backtrace_symbols_fd(callers, backtrace(callers, 64), STDERR_FILENO);
  }
  counting = true;
  errno = error;
  return true;
}

/// The same of the disk, where the power may go instead. The mutex is held.
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
bool memory_fails() { return is_to_fail(Kind::kMemory, ENOMEM, "allocation", "memory"); }

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

/// Writes to a file with `call`.
template <class Call>
ssize_t write_with(int fd, Call&& call) {
  State& s = state();
  const std::scoped_lock lock(s.mutex);
  const auto file = s.open.find(fd);
  if (file == s.open.end()) return call();
  if (disk_fails("write", file->second)) return -1;
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

using Main = int (*)(int, char**, char**);
Main real_main = nullptr;

int counted_main(int n, char** words, char** environment) {
  state();
  void* callers[2];
  backtrace(callers, 2);  // loads what it needs
  failing_call = std::atol(variable("FAILING_CALL").c_str());
  kind = kind_of(variable("FAILING_KIND"));
  counting = true;
  const int result = real_main(n, words, environment);
  counting = false;
  const std::string file = variable("FAILING_COUNT");
  if (std::FILE* out = file.empty() ? nullptr : std::fopen(file.c_str(), "w")) {
    std::fprintf(out, "%ld\n", calls.load());
    std::fclose(out);
  }
  return result;
}

}  // namespace

extern "C" {

int __libc_start_main(Main main, int n, char** words, void (*init)(), void (*fini)(),
                      void (*rtld_fini)(), void* stack_end) {
  real_main = main;
  const auto start = real<int (*)(Main, int, char**, void (*)(), void (*)(), void (*)(), void*)>(
      "__libc_start_main");
  return start(counted_main, n, words, init, fini, rtld_fini, stack_end);
}

int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  static const auto kReal = real<int (*)(const char*, int, ...)>("open");
  return open_with(path, (flags & (O_CREAT | O_DIRECTORY)) != 0,
                   [&] { return kReal(path, flags, mode); });
}

std::FILE* fopen(const char* path, const char* mode) {
  static const auto kReal = real<std::FILE* (*)(const char*, const char*)>("fopen");
  return open_stream(path, mode, kReal);
}

DIR* opendir(const char* path) {
  static const auto kReal = real<DIR* (*)(const char*)>("opendir");
  return open_fails(path) ? nullptr : kReal(path);
}

int openat(int folder, const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0;
  va_end(arguments);
  static const auto kReal = real<int (*)(int, const char*, int, ...)>("openat");
  return open_fails(path) ? -1 : kReal(folder, path, flags, mode);
}

int memfd_create(const char* name, unsigned flags) {
  static const auto kReal = real<int (*)(const char*, unsigned)>("memfd_create");
  return open_fails(name) ? -1 : kReal(name, flags);
}

int pipe2(int ends[2], int flags) {
  static const auto kReal = real<int (*)(int*, int)>("pipe2");
  return open_fails("a pipe") ? -1 : kReal(ends, flags);
}

ssize_t read(int fd, void* bytes, size_t size) {
  static const auto kReal = real<ssize_t (*)(int, void*, size_t)>("read");
  return is_to_fail(Kind::kRead, EIO, "read", "a file") ? -1 : kReal(fd, bytes, size);
}

ssize_t pread(int fd, void* bytes, size_t size, off_t at) {
  static const auto kReal = real<ssize_t (*)(int, void*, size_t, off_t)>("pread");
  return is_to_fail(Kind::kRead, EIO, "read", "a file") ? -1 : kReal(fd, bytes, size, at);
}

ssize_t write(int fd, const void* bytes, size_t size) {
  static const auto kReal = real<ssize_t (*)(int, const void*, size_t)>("write");
  return write_with(fd, [&] { return kReal(fd, bytes, size); });
}

ssize_t writev(int fd, const iovec* pieces, int count) {
  static const auto kReal = real<ssize_t (*)(int, const iovec*, int)>("writev");
  return write_with(fd, [&] { return kReal(fd, pieces, count); });
}

ssize_t pwrite(int fd, const void* bytes, size_t size, off_t at) {
  static const auto kReal = real<ssize_t (*)(int, const void*, size_t, off_t)>("pwrite");
  return write_with(fd, [&] { return kReal(fd, bytes, size, at); });
}

int fsync(int fd) {
  static const auto kReal = real<int (*)(int)>("fsync");
  State& s = state();
  const std::scoped_lock lock(s.mutex);
  const auto file = s.open.find(fd);
  if (file == s.open.end()) return kReal(fd);
  if (disk_fails("fsync", file->second)) return -1;
  if (const auto lost = s.not_synced.find(file->second); lost != s.not_synced.end()) {
    lost->second = false;
  }
  return kReal(fd);
}

int close(int fd) {
  static const auto kReal = real<int (*)(int)>("close");
  State& s = state();
  const std::scoped_lock lock(s.mutex);
  const bool fails = close_fails(fd);
  const int result = kReal(fd);
  if (!fails) return result;
  errno = ENOSPC;
  return -1;
}

int fclose(std::FILE* stream) {
  static const auto kReal = real<int (*)(std::FILE*)>("fclose");
  const std::scoped_lock lock(state().mutex);
  const bool fails = close_fails(fileno(stream));
  const int result = kReal(stream);
  if (!fails) return result;
  errno = ENOSPC;
  return EOF;
}

int rename(const char* from, const char* to) {
  static const auto kReal = real<int (*)(const char*, const char*)>("rename");
  State& s = state();
  const std::scoped_lock lock(s.mutex);
  if (counts(to) && disk_fails("rename", to)) return -1;
  const int result = kReal(from, to);
  if (result == 0 && s.not_synced.count(from) != 0) {
    s.not_synced[to] = s.not_synced[from];
    s.not_synced.erase(from);
  }
  return result;
}

int mkdir(const char* path, mode_t mode) {
  static const auto kReal = real<int (*)(const char*, mode_t)>("mkdir");
  return change_with("mkdir", path, [&] { return kReal(path, mode); });
}

int unlink(const char* path) {
  static const auto kReal = real<int (*)(const char*)>("unlink");
  return change_with("unlink", path, [&] { return kReal(path); });
}

int remove(const char* path) {
  static const auto kReal = real<int (*)(const char*)>("remove");
  return change_with("unlink", path, [&] { return kReal(path); });
}

int unlinkat(int folder, const char* path, int flags) {
  static const auto kReal = real<int (*)(int, const char*, int)>("unlinkat");
  if (kind != Kind::kDisk) return kReal(folder, path, flags);
  const std::scoped_lock lock(state().mutex);
  char name[PATH_MAX + 1] = {};
  const std::string link = "/proc/self/fd/" + std::to_string(folder);
  const bool is_ours = folder == AT_FDCWD
                           ? counts(path)
                           : readlink(link.c_str(), name, PATH_MAX) > 0 && counts(name);
  if (is_ours && disk_fails("unlink", path)) return -1;
  return kReal(folder, path, flags);
}

void* mmap(void* at, size_t size, int protection, int flags, int fd, off_t offset) {
  static const auto kReal = real<void* (*)(void*, size_t, int, int, int, off_t)>("mmap");
  if (is_to_fail(Kind::kMmap, ENOMEM, "mmap", fd < 0 ? "memory" : "a file")) return MAP_FAILED;
  return kReal(at, size, protection, flags, fd, offset);
}

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*run)(void*),
                   void* argument) {
  static const auto kReal = real<decltype(&pthread_create)>("pthread_create");
  if (is_to_fail(Kind::kThread, EAGAIN, "creation", "a thread")) return EAGAIN;
  return kReal(thread, attributes, run, argument);
}

int posix_spawnp(pid_t* child, const char* program, const posix_spawn_file_actions_t* actions,
                 const posix_spawnattr_t* attributes, char* const words[],
                 char* const environment[]) {
  static const auto kReal = real<decltype(&posix_spawnp)>("posix_spawnp");
  if (is_to_fail(Kind::kThread, EAGAIN, "creation", "a process")) return EAGAIN;
  return kReal(child, program, actions, attributes, words, environment);
}

// On 64 bit the same.
[[gnu::alias("open")]] int open64(const char* path, int flags, ...);
[[gnu::alias("openat")]] int openat64(int folder, const char* path, int flags, ...);
[[gnu::alias("fopen")]] std::FILE* fopen64(const char* path, const char* mode);
[[gnu::alias("pread")]] ssize_t pread64(int fd, void* bytes, size_t size, off_t at);
[[gnu::alias("pwrite")]] ssize_t pwrite64(int fd, const void* bytes, size_t size, off_t at);
[[gnu::alias("mmap")]] void* mmap64(void* at, size_t size, int protection, int flags, int fd,
                                    off_t offset);

// By other names, which need no look-up.
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* old, size_t size);
void* __libc_memalign(size_t alignment, size_t size);

void* malloc(size_t size) { return memory_fails() ? nullptr : __libc_malloc(size); }
void* calloc(size_t count, size_t size) {
  return memory_fails() ? nullptr : __libc_calloc(count, size);
}
void* realloc(void* old, size_t size) {
  return memory_fails() ? nullptr : __libc_realloc(old, size);
}
void* memalign(size_t alignment, size_t size) {
  return memory_fails() ? nullptr : __libc_memalign(alignment, size);
}
void* aligned_alloc(size_t alignment, size_t size) { return memalign(alignment, size); }
int posix_memalign(void** out, size_t alignment, size_t size) {
  if (memory_fails()) return ENOMEM;
  *out = __libc_memalign(alignment, size);
  return *out != nullptr ? 0 : ENOMEM;
}

}  // extern "C"
