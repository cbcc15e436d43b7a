#include "viwo/experiment/shard.hpp"

#include <charconv>
#include <cstdlib>
#include <string_view>

#include "viwo/api/status.hpp"

namespace viwo::experiment {
namespace {

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw InputError("--shard " + text + ": " + why +
                   " (I/N, numbers or names of environment variables: 0/8, "
                   "SLURM_ARRAY_TASK_ID/SLURM_ARRAY_TASK_COUNT)");
}

int number_of(const std::string& text, std::string_view word) {
  std::string value(word);
  std::string from;
  if (!value.empty() && (value[0] < '0' || value[0] > '9') && value[0] != '-') {
    const char* const set = std::getenv(value.c_str());
    if (set == nullptr) refuse(text, "there is no environment variable " + value);
    from = value + "=";
    value = set;
  }
  int number = 0;
  const auto end = value.data() + value.size();
  const auto [at, error] = std::from_chars(value.data(), end, number);
  if (error != std::errc() || at != end) refuse(text, "'" + from + value + "' is no number");
  return number;
}

}  // namespace

Shard read_shard(const std::string& text) {
  const auto slash = text.find('/');
  if (slash == std::string::npos) refuse(text, "there is no '/'");
  const std::string_view whole = text;
  const int index = number_of(text, whole.substr(0, slash));
  const int count = number_of(text, whole.substr(slash + 1));
  if (count < 1) refuse(text, "there must be at least one shard");
  if (index < 0 || index > count) {
    refuse(text, std::to_string(index) + " is none of " + std::to_string(count) + " shards");
  }
  return {index % count, count};
}

}  // namespace viwo::experiment
