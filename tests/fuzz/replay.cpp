// viwo_fuzz_replay CORPUS           every file of CORPUS/TARGET through its target: at least one of
//                                   each target must be taken without an error
// viwo_fuzz_replay TARGET FILE...   files (of folders all) through a target, with its answers
// viwo_fuzz_replay --random TARGET COUNT   bytes that a seed has drawn, through a target
// viwo_fuzz_replay --list           names of the targets, and whose lines they are to cover
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <iterator>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <malloc.h>
#include <sys/resource.h>

#include "target.hpp"

namespace {

namespace fs = std::filesystem;
using viwo::fuzz::Target;

/// In an order that does not depend on the file system.
std::vector<fs::path> files_of(const fs::path& path) {
  if (!fs::is_directory(path)) return {path};
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(path)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// What becomes of a file. One that ends the process has been named before.
std::string replay(const Target& target, const fs::path& file, bool tell) {
  std::ifstream in(file, std::ios::binary);
  std::vector<char> bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (!in.is_open()) throw std::runtime_error("cannot be read");
  const std::string at = target.name + " " + file.string();
  if (tell) std::fprintf(stderr, "%s\n", at.c_str());
  const std::string answer =
      viwo::fuzz::run(target, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  if (tell) std::fprintf(stderr, "  %s\n", answer.empty() ? "taken" : answer.c_str());
  return answer;
}

/// Whether all went as it must.
bool replay_all(const fs::path& corpus) {
  bool good = true;
  for (const Target& target : viwo::fuzz::targets()) {
    int files = 0, taken = 0;
    for (const fs::path& file : files_of(corpus / target.name)) {
      std::printf("%s %s\n", target.name.c_str(), file.filename().c_str());
      std::fflush(stdout);
      ++files;
      if (replay(target, file, false).empty()) ++taken;
    }
    std::printf("%s: %d files, %d taken\n", target.name.c_str(), files, taken);
    if (taken == 0) good = false;
  }
  std::printf("%s\n", good ? "good"
                           : "a target takes none of its files: where a format has changed, "
                             "tests/fuzz/make_seeds.py makes them anew (DEVELOPERS.md)");
  return good;
}

/// What nobody's file may need more of. The address sanitizer reserves terabytes.
void limit_memory() {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && !defined(__clang__)
  const rlimit limit{rlim_t{2} << 30, rlim_t{2} << 30};
  setrlimit(RLIMIT_AS, &limit);
  mallopt(M_ARENA_MAX, 2);  // or each thread of a decoder of videos, one per core, reserves 64 MiB
#endif
}

/// The same bytes on every machine; the last seed that is told is the finding.
void run_random(const Target& target, int count) {
  for (int seed = 1; seed <= count; ++seed) {
    std::printf("%s seed %d\n", target.name.c_str(), seed);
    std::fflush(stdout);
    std::mt19937_64 draw(static_cast<std::uint64_t>(seed));
    std::vector<std::uint8_t> bytes(draw() % 2048);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(draw());
    viwo::fuzz::run(target, bytes);
  }
}

int run(const std::vector<std::string>& arguments) {
  if (arguments.size() == 1 && arguments[0] == "--list") {
    for (const Target& target : viwo::fuzz::targets()) {
      std::printf("%s %s\n", target.name.c_str(), target.sources.c_str());
    }
    return 0;
  }
  limit_memory();
  if (arguments.size() == 1) return replay_all(arguments[0]) ? 0 : 1;
  if (arguments.size() == 3 && arguments[0] == "--random") {
    const Target* const target = viwo::fuzz::find(arguments[1]);
    if (target == nullptr) throw std::runtime_error("no target " + arguments[1]);
    run_random(*target, std::stoi(arguments[2]));
    return 0;
  }
  const Target* const target = arguments.empty() ? nullptr : viwo::fuzz::find(arguments[0]);
  if (target == nullptr) {
    std::fprintf(
        stderr,
        "usage: viwo_fuzz_replay CORPUS | TARGET FILE... | --random TARGET COUNT | --list\n");
    return 2;
  }
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    for (const fs::path& file : files_of(arguments[i])) replay(*target, file, true);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::printf("finding: %s\n", error.what());
    return 1;
  }
}
