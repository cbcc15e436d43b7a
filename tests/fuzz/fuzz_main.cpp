// libFuzzer's entry: the target is named by the variable VIWO_FUZZ_TARGET (scripts/fuzz.sh).
#include <cstdio>
#include <cstdlib>

#include "target.hpp"

namespace {

const viwo::fuzz::Target& target() {
  static const viwo::fuzz::Target* const chosen = [] {
    const char* const name = std::getenv("VIWO_FUZZ_TARGET");
    const auto* found = viwo::fuzz::find(name != nullptr ? name : "");
    if (found == nullptr) {
      std::fprintf(stderr, "VIWO_FUZZ_TARGET must be the name of a target\n");
      std::exit(2);
    }
    return found;
  }();
  return *chosen;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  viwo::fuzz::run(target(), {data, size});
  return 0;
}
