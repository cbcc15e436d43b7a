#include "target.hpp"

#include <algorithm>
#include <fstream>
#include <stdexcept>

#include <unistd.h>

#include "viwo/api/status.hpp"
#include "viwo/setup/configuration.hpp"

namespace viwo::fuzz {
namespace {

namespace fs = std::filesystem;

class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("viwo_fuzz_" + std::to_string(getpid()))) {
    fs::remove_all(path_);
    fs::copy(VIWO_FUZZ_FILES, path_, fs::copy_options::recursive);
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::vector<Target> all_targets() {
  std::vector<Target> all;
  for (auto&& some :
       {sensor_targets(), file_targets(), live_targets(), filter_targets(), wheel_targets()}) {
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

}  // namespace

const std::vector<Target>& targets() {
  static const std::vector<Target> all = all_targets();
  return all;
}

const Target* find(const std::string& name) {
  const auto& all = targets();
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&name](const Target& target) { return target.name == name; });
  return found != all.end() ? &*found : nullptr;
}

std::string run(const Target& target, Bytes bytes) {
  try {
    target.run(bytes);
    return "";
  } catch (const InputError& error) {
    require(error.what()[0] != '\0', "an error without a text");
    return error.what();
  }
}

void require(bool holds, const std::string& what) {
  if (!holds) throw std::logic_error(what);
}

const fs::path& folder() {
  static const Folder own;
  return own.path();
}

Bytes bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

fs::path write(const std::string& name, Bytes bytes) {
  const fs::path file = folder() / name;
  fs::create_directories(file.parent_path());
  std::ofstream out(file, std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
  require(out.good(), "cannot write " + file.string());
  return file;
}

PluginRegistry& registry() {
  static PluginRegistry plugins({VIWO_TEST_PLUGIN_DIR}, [](auto&&...) {});
  return plugins;
}

config::Node configuration(const std::string& file, const std::vector<std::string>& set) {
  return resolve_placeholders(load_run_configuration(folder() / file, set));
}

void require_well(const RunResult& result) {
  if (result.status != RunStatus::kOk) {
    return require(!result.cause.empty(), "a run that is not well, without a cause");
  }
  for (const StampedPose& pose : result.estimate) {
    require(pose.p_BinW.allFinite() && pose.q_BtoW.coeffs().allFinite(),
            "a trajectory that is not finite, and the run says that it is well");
  }
}

}  // namespace viwo::fuzz
