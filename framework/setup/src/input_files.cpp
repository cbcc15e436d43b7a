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

/// The folder in which it is, or would be, by its own name.
fs::path folder_of(const fs::path& file) {
  std::error_code ignored;
  const fs::path folder = fs::absolute(file, ignored).parent_path();
  const fs::path canonical = fs::weakly_canonical(folder, ignored);
  return canonical.empty() ? folder : canonical;
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

std::vector<fs::path> input_files(const RunSetup& setup) {
  std::vector<fs::path> out = input_files(setup.resolved);
  if (!setup.imu_file.empty()) out.push_back(setup.imu_file);
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

void refuse_to_write_into(const fs::path& written, const std::vector<fs::path>& inputs) {
  refuse_to_replace(written, inputs);
  for (fs::path at = folder_of(written); at.has_relative_path(); at = at.parent_path()) {
    for (const fs::path& input : inputs) {
      std::error_code not_there;
      if (!fs::is_directory(input, not_there) || !fs::equivalent(at, input, not_there)) continue;
      throw InputError(written.string() + "  lies in the input " + input.string() +
                       ", of which it would become a part - write it elsewhere");
    }
  }
}

void refuse_to_empty(const fs::path& folder, const std::vector<fs::path>& inputs) {
  for (const fs::path& input : inputs) {
    std::error_code not_there;
    for (fs::path at = fs::absolute(input, not_there); at.has_relative_path();
         at = at.parent_path()) {
      if (!fs::equivalent(folder, at, not_there)) continue;
      throw InputError(folder.string() + "  holds the input " + input.string() +
                       ", which would be lost - choose another --out");
    }
  }
}

}  // namespace viwo
