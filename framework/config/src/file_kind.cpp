#include "viwo/config/file_kind.hpp"

#include <algorithm>
#include <iterator>
#include <system_error>

#include "viwo/config/errors.hpp"

namespace viwo::config {

void require_file_of(std::string_view command, const Node& file) {
  struct Kind {
    const char *command, *what, *key, *with;  ///< keys that together only this kind has
  };
  constexpr Kind kKinds[] = {{"experiment", "an experiment", "experiment", "experiment"},
                             {"calibrate", "a calibration", "calibration", "base"},
                             {"plan", "a plan", "plan", "plan"},
                             {"run", "a run", "sensors", "sensors"}};
  const auto is_of = [&](const Kind& kind) {
    return file.find(kind.key) != nullptr && file.find(kind.with) != nullptr;
  };
  const auto* const wanted =
      std::find_if(std::begin(kKinds), std::end(kKinds),
                   [&](const Kind& kind) { return command == kind.command; });
  if (!file.is_map() || is_of(*wanted)) return;
  for (const Kind& kind : kKinds) {
    if (!is_of(kind)) continue;
    fail(file.find_entry(kind.key)->key_mark, std::string("this is ") + kind.what + ", not " +
                                                  wanted->what + ": viwo " + kind.command +
                                                  " takes it");
  }
}

void require_file_of_key(const std::string& key, const Node& node,
                         const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::status(file, ignored).type() != std::filesystem::file_type::not_found)
    return;
  fail(node.mark(), key + ": no such file: " + file.lexically_normal().string());
}

}  // namespace viwo::config
