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

std::vector<std::string_view> faster_instruction_sets() {
  std::vector<std::string_view> sets;
#ifdef __x86_64__
  if (std::getenv("VIWO_NO_FASTER_COPY") != nullptr) return sets;
  // All processors that have these have the rest of the set.
  const bool v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                  __builtin_cpu_supports("bmi2");
  const bool v4 = v3 && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd") &&
                  __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  if (v4) sets.push_back("x86-64-v4");
  if (v3) sets.push_back("x86-64-v3");
#endif
  return sets;
}

fs::path installation_prefix() {
  const fs::path folder = this_program().parent_path();
  const fs::path copies = folder.parent_path();  // PREFIX/lib/viwo of PREFIX/lib/viwo/ISA/viwo
  const fs::path prefix = copies.parent_path().parent_path();
  return copies == prefix / kCopies ? prefix : copies;
}

fs::path fastest_copy(const fs::path& plugin) {
  for (const std::string_view set : faster_instruction_sets()) {
    fs::path copy = plugin.parent_path() / set / plugin.filename();
    std::error_code error;
    if (fs::exists(copy, error)) return copy;
  }
  return plugin;
}

void become_faster_copy(char** argv) {
  const fs::path program = this_program();
  for (const std::string_view set : faster_instruction_sets()) {
    const fs::path copy = installation_prefix() / kCopies / set / program.filename();
    if (copy == program) return;
    ::execv(copy.c_str(), argv);  // Where it fails, a slower one goes on.
  }
}

}  // namespace viwo
