// What the functions share that stand before those of the system (failing_calls.cpp).
#pragma once

#include <string>

#include <dlfcn.h>

namespace failing {

enum class Kind { kDisk, kOpen, kRead, kDescriptor, kMmap, kThread, kMemory };

/// The system's.
template <class F>
F real(const char* name) {
  return reinterpret_cast<F>(dlsym(RTLD_NEXT, name));
}

/// Whether calls of this kind are counted at all, and now.
bool is_kind(Kind kind);
bool is_counted(Kind kind);

/// One more call; whether it is to fail, which is said. Sets errno.
bool is_to_fail(Kind of, int error, const char* call, const char* what);
/// The same of what is open.
bool is_to_fail(Kind of, int error, const char* call, int fd);

/// Also of what was opened to read only, by which others may sync it; "pipe:[1]" and the like where
/// there is no path.
std::string path_of(int fd);

/// A variable of the environment, or "".
std::string variable(const char* name);

/// The disk's part: memory to remember by, before anything is counted; with FAILING_HOW=power one
/// more call, behind the last one.
void begin_on_disk();
void end_on_disk();

}  // namespace failing
