#include "viwo/plugin_host/installation.hpp"

#include <cstdlib>
#include <system_error>

#include <unistd.h>

namespace viwo {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCopies = "lib/viwo";

fs::path this_program() {
  std::error_code error;
  return fs::read_symlink("/proc/self/exe", error);
}

}  // namespace

std::string_view faster_instruction_set() {
#ifdef __x86_64__
  if (std::getenv("VIWO_NO_FASTER_COPY") != nullptr) return {};
  // All processors that have these have the rest of x86-64-v3.
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
      __builtin_cpu_supports("bmi2")) {
    return "x86-64-v3";
  }
#endif
  return {};
}

fs::path installation_prefix() {
  const fs::path folder = this_program().parent_path();
  const fs::path copies = folder.parent_path();  // PREFIX/lib/viwo of PREFIX/lib/viwo/ISA/viwo
  const fs::path prefix = copies.parent_path().parent_path();
  return copies == prefix / kCopies ? prefix : copies;
}

fs::path fastest_copy(const fs::path& plugin) {
  const std::string_view set = faster_instruction_set();
  if (set.empty()) return plugin;
  fs::path copy = plugin.parent_path() / set / plugin.filename();
  std::error_code error;
  return fs::exists(copy, error) ? copy : plugin;
}

void become_faster_copy(char** argv) {
  const std::string_view set = faster_instruction_set();
  if (set.empty()) return;
  const fs::path program = this_program();
  const fs::path copy = installation_prefix() / kCopies / set / program.filename();
  if (copy != program) ::execv(copy.c_str(), argv);  // Where it fails, this one goes on.
}

}  // namespace viwo
