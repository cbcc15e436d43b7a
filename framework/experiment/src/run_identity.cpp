#include "run_identity.hpp"

#include <algorithm>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <vector>

#include "checksum.hpp"
#include "viwo/config/regular_file.hpp"
#include "viwo/config/yaml.hpp"
#include "viwo/results/run_output.hpp"
#include "viwo/setup/input_files.hpp"

namespace viwo::experiment {
namespace {

namespace fs = std::filesystem;

/// "SIZE bytes, crc NUMBER"
std::string checksum_of(const fs::path& file) {
  std::vector<char> buffer(std::size_t{1} << 20);
  std::uint32_t crc = 0;
  std::uintmax_t size = 0;
  try {
    config::RegularFile in(file);
    while (const std::size_t count = in.read(buffer)) {
      crc = crc_of({buffer.data(), count}, crc);
      size += count;
    }
  } catch (const std::system_error& error) {
    throw std::runtime_error("cannot read " + file.string() + ": " + error.code().message());
  }
  return std::to_string(size) + " bytes, crc " + std::to_string(crc);
}

/// Of all files below it but those of the results, in the order of their names.
std::string checksums_of(const fs::path& folder, const fs::path& results) {
  std::vector<fs::path> files;
  // Parts of a log may be links to folders. One that leads to where it is is an error that is told.
  constexpr auto kFollow = fs::directory_options::follow_directory_symlink;
  constexpr int kDeepest = 32;
  for (fs::recursive_directory_iterator at(folder, kFollow), end; at != end; ++at) {
    if (at->is_regular_file()) files.push_back(at->path());
    if (at->is_directory() && fs::weakly_canonical(at->path()) == results) {
      at.disable_recursion_pending();
    }
    if (at.depth() > kDeepest) {
      throw std::runtime_error(at->path().string() + "  lies too deep: a link to where it is?");
    }
  }
  std::sort(files.begin(), files.end());
  std::string text;
  for (const fs::path& file : files) {
    text += file.lexically_relative(folder).string() + ": " + checksum_of(file) + "\n";
  }
  return std::to_string(files.size()) + " files, crc " + std::to_string(crc_of(text));
}

}  // namespace

std::string RunIdentity::of(const RunSetup& run) {
  // The filter is in the program.
  std::string text =
      std::string("viwo ") + viwo_version() + ": " + content_of("/proc/self/exe") + "\n";
  const auto add = [&](const PluginInfo& info) {
    text += info.kind + " " + info.name + " " + info.version;
    // One that is linked into the program has none.
    if (fs::is_regular_file(info.file)) text += ": " + content_of(info.file);
    text += "\n";
  };
  if (run.kinematics.object) add(run.kinematics.info);
  for (const SensorEntry& entry : run.sensors) add(entry.sensor.info);
  if (run.filter) {
    for (const auto& entry : run.filter->updates) add(entry.update.info);
    for (const WheelSet& set : run.filter->wheels) add(set.info);
  }
  config::Node configuration = run.resolved;
  replace_paths(configuration);
  return text + config::to_yaml(configuration);
}

const std::string& RunIdentity::content_of(const fs::path& path) {
  const auto [at, is_new] = contents_.try_emplace(path);
  if (is_new)
    at->second = fs::is_directory(path) ? checksums_of(path, results_) : checksum_of(path);
  return at->second;
}

void RunIdentity::replace_paths(config::Node& node) {
  for (config::Node& item : node.items()) replace_paths(item);
  for (config::Node::Entry& entry : node.entries()) replace_paths(entry.value);
  if (const auto file = input_file(node)) {
    node = config::Node::scalar_of(file->filename().string() + ": " + content_of(*file));
  }
}

}  // namespace viwo::experiment
