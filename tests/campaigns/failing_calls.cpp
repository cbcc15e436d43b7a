// To be preloaded: the n-th call of a kind fails, once, between the begin and the end of main().
// Calls are counted over all threads.
//   FAILING_KIND=disk        what changes something below FAILING_FOLDER: open, write, sendfile,
//                            ftruncate, fsync, close, rename, mkdir, unlink ("No space left on
//                            device")
//                open        opens a file, a folder or a pipe, whichever, or another descriptor of
//                            it ("Too many open files")
//                read        reads from a file or a folder that was opened ("Input/output error")
//                descriptor  looks at what was opened, locks it or sets its flags: fstat, flock,
//                            fcntl ("Input/output error")
//                mmap        maps memory or a file, or protects it ("Cannot allocate memory")
//                thread      begins a thread or a process ("Resource temporarily unavailable")
//                memory      allocates ("Cannot allocate memory")
//   FAILING_FOLDER=DIR   for the kind disk
//   FAILING_CALL=N       1, 2, ...; 0: none, only counted
//   FAILING_HOW=error    it returns an error
//               power    what was written below the folder and not synced is lost, and the process
//                        with it
//   FAILING_COUNT=FILE   gets the number of calls at the end
//   FAILING_TRACE=1      shows who called
// Not here: vfork(), which a function cannot stand before; stat(), by which viwo asks whether
// something is there; and what viwo does not call (link(), copy_file_range(), posix_spawn()).
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include "failing_calls.hpp"

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>

#include <dirent.h>
#include <execinfo.h>
#include <fcntl.h>
#include <pthread.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace failing {
namespace {

// No more than this is needed to count, for whoever remembers more allocates.
std::atomic<bool> counting = false;
std::atomic<long> calls = 0;
std::atomic<Kind> counted_kind = Kind::kDisk;
long failing_call = 0;

Kind kind_of(const std::string& name) {
  if (name == "open") return Kind::kOpen;
  if (name == "read") return Kind::kRead;
  if (name == "descriptor") return Kind::kDescriptor;
  if (name == "mmap") return Kind::kMmap;
  if (name == "thread") return Kind::kThread;
  if (name == "memory") return Kind::kMemory;
  return Kind::kDisk;
}

/// One more call; whether it is its turn.
bool is_due(Kind of) { return is_counted(of) && ++calls == failing_call; }

void say(const char* call, const char* what) {
  counting = false;  // what follows is no call of the program
  std::fprintf(stderr, "failing_calls: %s of %s fails\n", call, what);
  if (!variable("FAILING_TRACE").empty()) {
    void* callers[64];
    backtrace_symbols_fd(callers, backtrace(callers, 64), STDERR_FILENO);
  }
  counting = true;
}

bool memory_fails() { return is_to_fail(Kind::kMemory, ENOMEM, "allocation", "memory"); }

/// Whether fcntl() is to fail: what makes another descriptor, locks, or sets flags or seals.
bool fcntl_fails(int fd, int command) {
  switch (command) {
    case F_DUPFD:
    case F_DUPFD_CLOEXEC:
      return is_to_fail(Kind::kOpen, EMFILE, "fcntl", fd);
    case F_SETFL:
    case F_SETLK:
    case F_SETLKW:
    case F_OFD_SETLK:
    case F_OFD_SETLKW:
    case F_ADD_SEALS:
      return is_to_fail(Kind::kDescriptor, EIO, "fcntl", fd);
    default:
      return false;
  }
}

using Main = int (*)(int, char**, char**);
Main real_main = nullptr;

int counted_main(int n, char** words, char** environment) {
  begin_on_disk();
  void* callers[2];
  backtrace(callers, 2);  // loads what it needs
  failing_call = std::atol(variable("FAILING_CALL").c_str());
  counted_kind = kind_of(variable("FAILING_KIND"));
  counting = true;
  const int result = real_main(n, words, environment);
  end_on_disk();
  counting = false;
  const std::string file = variable("FAILING_COUNT");
  if (std::FILE* out = file.empty() ? nullptr : std::fopen(file.c_str(), "w")) {
    std::fprintf(out, "%ld\n", calls.load());
    std::fclose(out);
  }
  return result;
}

}  // namespace

bool is_kind(Kind kind) { return counted_kind == kind; }
bool is_counted(Kind kind) { return counting && is_kind(kind); }

bool is_to_fail(Kind of, int error, const char* call, const char* what) {
  if (!is_due(of)) return false;
  say(call, what);
  errno = error;
  return true;
}

bool is_to_fail(Kind of, int error, const char* call, int fd) {
  if (!is_due(of)) return false;
  say(call, path_of(fd).c_str());
  errno = error;
  return true;
}

std::string path_of(int fd) {
  char name[PATH_MAX + 1] = {};
  const std::string link = "/proc/self/fd/" + std::to_string(fd);
  return readlink(link.c_str(), name, PATH_MAX) > 0 ? name : "";
}

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

}  // namespace failing

extern "C" {

int __libc_start_main(failing::Main main, int n, char** words, void (*init)(), void (*fini)(),
                      void (*rtld_fini)(), void* stack_end) {
  failing::real_main = main;
  const auto start =
      failing::real<int (*)(failing::Main, int, char**, void (*)(), void (*)(), void (*)(), void*)>(
          "__libc_start_main");
  return start(failing::counted_main, n, words, init, fini, rtld_fini, stack_end);
}

ssize_t read(int fd, void* bytes, size_t size) {
  static const auto kReal = failing::real<ssize_t (*)(int, void*, size_t)>("read");
  if (failing::is_to_fail(failing::Kind::kRead, EIO, "read", fd)) return -1;
  return kReal(fd, bytes, size);
}

ssize_t pread(int fd, void* bytes, size_t size, off_t at) {
  static const auto kReal = failing::real<ssize_t (*)(int, void*, size_t, off_t)>("pread");
  if (failing::is_to_fail(failing::Kind::kRead, EIO, "read", fd)) return -1;
  return kReal(fd, bytes, size, at);
}

dirent* readdir(DIR* folder) {
  static const auto kReal = failing::real<dirent* (*)(DIR*)>("readdir");
  if (failing::is_to_fail(failing::Kind::kRead, EIO, "read", dirfd(folder))) return nullptr;
  return kReal(folder);
}

int fstat(int fd, struct stat* found) {
  static const auto kReal = failing::real<int (*)(int, struct stat*)>("fstat");
  if (failing::is_to_fail(failing::Kind::kDescriptor, EIO, "fstat", fd)) return -1;
  return kReal(fd, found);
}

int fstat64(int fd, struct stat64* found) {
  static const auto kReal = failing::real<int (*)(int, struct stat64*)>("fstat64");
  if (failing::is_to_fail(failing::Kind::kDescriptor, EIO, "fstat", fd)) return -1;
  return kReal(fd, found);
}

int flock(int fd, int operation) {
  static const auto kReal = failing::real<int (*)(int, int)>("flock");
  if (failing::is_to_fail(failing::Kind::kDescriptor, EIO, "flock", fd)) return -1;
  return kReal(fd, operation);
}

int fcntl(int fd, int command, ...) {
  va_list arguments;
  va_start(arguments, command);
  void* const argument = va_arg(arguments, void*);  // whichever it is: so does the system's
  va_end(arguments);
  static const auto kReal = failing::real<int (*)(int, int, ...)>("fcntl");
  return failing::fcntl_fails(fd, command) ? -1 : kReal(fd, command, argument);
}

void* mmap(void* at, size_t size, int protection, int flags, int fd, off_t offset) {
  static const auto kReal = failing::real<void* (*)(void*, size_t, int, int, int, off_t)>("mmap");
  const bool fails = fd < 0 ? failing::is_to_fail(failing::Kind::kMmap, ENOMEM, "mmap", "memory")
                            : failing::is_to_fail(failing::Kind::kMmap, ENOMEM, "mmap", fd);
  if (fails) return MAP_FAILED;
  return kReal(at, size, protection, flags, fd, offset);
}

int mprotect(void* at, size_t size, int protection) {
  static const auto kReal = failing::real<int (*)(void*, size_t, int)>("mprotect");
  if (failing::is_to_fail(failing::Kind::kMmap, ENOMEM, "mprotect", "memory")) return -1;
  return kReal(at, size, protection);
}

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*run)(void*),
                   void* argument) {
  static const auto kReal = failing::real<decltype(&pthread_create)>("pthread_create");
  if (failing::is_to_fail(failing::Kind::kThread, EAGAIN, "creation", "a thread")) return EAGAIN;
  return kReal(thread, attributes, run, argument);
}

int posix_spawnp(pid_t* child, const char* program, const posix_spawn_file_actions_t* actions,
                 const posix_spawnattr_t* attributes, char* const words[],
                 char* const environment[]) {
  static const auto kReal = failing::real<decltype(&posix_spawnp)>("posix_spawnp");
  if (failing::is_to_fail(failing::Kind::kThread, EAGAIN, "creation", program)) return EAGAIN;
  return kReal(child, program, actions, attributes, words, environment);
}

pid_t fork() {
  static const auto kReal = failing::real<pid_t (*)()>("fork");
  if (failing::is_to_fail(failing::Kind::kThread, EAGAIN, "creation", "a process")) return -1;
  return kReal();
}

// On 64 bit the same.
[[gnu::alias("pread")]] ssize_t pread64(int fd, void* bytes, size_t size, off_t at);
[[gnu::alias("fcntl")]] int fcntl64(int fd, int command, ...);
[[gnu::alias("mmap")]] void* mmap64(void* at, size_t size, int protection, int flags, int fd,
                                    off_t offset);

// By other names, which need no look-up.
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* old, size_t size);
void* __libc_memalign(size_t alignment, size_t size);

void* malloc(size_t size) { return failing::memory_fails() ? nullptr : __libc_malloc(size); }
void* calloc(size_t count, size_t size) {
  return failing::memory_fails() ? nullptr : __libc_calloc(count, size);
}
void* realloc(void* old, size_t size) {
  return failing::memory_fails() ? nullptr : __libc_realloc(old, size);
}
void* memalign(size_t alignment, size_t size) {
  return failing::memory_fails() ? nullptr : __libc_memalign(alignment, size);
}
void* aligned_alloc(size_t alignment, size_t size) { return memalign(alignment, size); }
int posix_memalign(void** out, size_t alignment, size_t size) {
  if (failing::memory_fails()) return ENOMEM;
  *out = __libc_memalign(alignment, size);
  return *out != nullptr ? 0 : ENOMEM;
}

}  // extern "C"
