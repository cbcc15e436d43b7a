#include "viwo/setup/input_files.hpp"

#include <algorithm>
#include <string>
#include <system_error>

#include "viwo/api/status.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

void add_input_files(const config::Node& node, std::vector<fs::path>& out) {
  for (const config::Node& item : node.items()) add_input_files(item, out);
  for (const config::Node::Entry& entry : node.entries()) add_input_files(entry.value, out);
  if (const auto file = input_file(node)) out.push_back(*file);
}

}  // namespace

std::optional<fs::path> input_file(const config::Node& scalar) {
  if (!scalar.is_scalar() || !scalar.scalar().starts_with('/')) return std::nullopt;
  for (const char* extension : {"", ".gz"}) {
    const fs::path path = scalar.scalar() + extension;
    std::error_code not_there;
    if (fs::is_regular_file(path, not_there) || fs::is_directory(path, not_there)) return path;
  }
  return std::nullopt;
}

std::vector<fs::path> input_files(const config::Node& resolved) {
  std::vector<fs::path> out;
  add_input_files(resolved, out);
  return out;
}

void refuse_to_replace(const fs::path& written, const std::vector<fs::path>& inputs) {
  for (const fs::path& input : inputs) {
    std::error_code not_there;
    if (!fs::equivalent(written, input, not_there)) continue;
    throw InputError(written.string() +
                     "  is an input, which the results would replace - write them elsewhere");
  }
}

void refuse_to_empty(const fs::path& folder, const std::vector<fs::path>& inputs) {
  for (const fs::path& input : inputs) {
    for (fs::path at = input; at.has_relative_path(); at = at.parent_path()) {
      std::error_code not_there;
      if (!fs::equivalent(folder, at, not_there)) continue;
      throw InputError(folder.string() + "  holds the input " + input.string() +
                       ", which would be lost - choose another --out");
    }
  }
}

}  // namespace viwo
