#include "out_of_memory.hpp"

#include <atomic>
#include <cstdlib>
#include <exception>
#include <new>
#include <string_view>

#include <unistd.h>

namespace viwo::app {
namespace {

std::atomic<bool> memory_is_short = false;

void note_that_memory_is_short() {
  memory_is_short = true;
  throw std::bad_alloc();
}

/// Of a defect there is a core to look at.
[[noreturn]] void end() {
  if (!memory_is_short) std::abort();
  constexpr std::string_view kText = "viwo: there is not enough memory\n";
  // Who cannot read it sees the exit code.
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, kText.data(), kText.size());
  std::_Exit(1);
}

}  // namespace

void end_well_without_memory() {
  std::set_new_handler(note_that_memory_is_short);
  std::set_terminate(end);
}

}  // namespace viwo::app
