// Finds plugins by kind and name, refuses what does not fit, and makes objects from configuration.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/api/host_services.hpp"
#include "viwo/api/kinematic_model.hpp"
#include "viwo/api/params.hpp"
#include "viwo/api/sensor.hpp"
#include "viwo/api/update.hpp"
#include "viwo/config/errors.hpp"
#include "viwo/config/node.hpp"
#include "viwo/plugin_host/plugin_info.hpp"
#include "viwo/plugin_host/sample_kinds.hpp"

namespace viwo {

class Library;

/// Where plugins' messages go. May be called from any thread.
using PluginLog = std::function<void(const PluginInfo&, LogLevel, std::string_view text)>;

/// An object from a plugin. `object` is null if there were errors.
template <class Interface>
struct Loaded {
  std::shared_ptr<Interface> object;  ///< keeps its library and the models it was given
  PluginInfo info;
  config::Node resolved;  ///< `type` and every parameter: a valid section of a configuration
};

/// A file in the search path: its plugin, or why it is refused. Or a folder that cannot be read.
struct PluginListing {
  std::filesystem::path file;
  std::optional<PluginInfo> info;
  std::string refusal;          ///< PluginRefused::reason(); empty with `info`
  bool is_unavailable = false;  ///< PluginUnavailable: a plugin may be missing in the list
};

/// Seed of the plugin of `kind` ("kinematics", "update") that a run with `run_seed` makes from the
/// section at `path` ("updates.height"). It depends on these three alone, not on what other
/// sections there are nor on their order: SplitMix64's output function of the run's seed, plus
/// FNV-1a (64 bit) over kind, a zero byte and path, mixed by that function again.
std::uint64_t instance_seed(std::uint64_t run_seed, std::string_view kind, std::string_view path);

/// Plugins are files libviwo_<kind>_<name>.so; one is loaded when it is first asked for and stays
/// loaded until the process exits. Two files of the same kind and name anywhere in the search path
/// are an error for whoever asks for that plugin. All calls may run concurrently.
class PluginRegistry {
 public:
  /// Without `log`, messages go to stderr.
  explicit PluginRegistry(std::vector<std::filesystem::path> folders, PluginLog log = {});
  ~PluginRegistry();
  PluginRegistry(const PluginRegistry&) = delete;
  PluginRegistry& operator=(const PluginRegistry&) = delete;

  /// `extra` (the command line's), then VIWO_PLUGIN_PATH (separated by colons), then
  /// ../lib/viwo/plugins/v<api> beside the folder of the executable. Throws viwo::InputError if
  /// one of `extra` is not a folder.
  static std::vector<std::filesystem::path> default_search_path(
      const std::vector<std::filesystem::path>& extra = {});

  /// Loads one plugin. Throws viwo::InputError when there is none or more than one, with the
  /// nearest spelling or the names that exist; PluginRefused when its file does not fit.
  PluginInfo find(std::string_view kind, std::string_view name);

  /// Loads a file, in the search path or not. Throws PluginRefused.
  PluginInfo check(const std::filesystem::path& file);

  /// Every *.so of the search path, loaded or refused; sorted by file name within a folder. Folders
  /// that are not there have none; those that cannot be read are in the list themselves.
  std::vector<PluginListing> list();

  /// Makes a model from {type: NAME, its parameters}. `path` is where the section is, for messages;
  /// `seed` is for its random numbers, and models nested in it get seeds made from it and their
  /// path; keys in `other_keys` are the caller's. What the user has to mend goes into `errors`,
  /// then the object is null; PluginFailure if the plugin's constructor failed in another way.
  Loaded<KinematicModel> make_kinematics(const config::Node& section, const std::string& path,
                                         std::uint64_t seed, config::Errors& errors,
                                         std::span<const std::string_view> other_keys = {});

  /// The same for a sensor; `exact`: HostServices::exact. Kinds of samples that another plugin, or
  /// viwo, knows in another version or layout are an error.
  Loaded<Sensor> make_sensor(const config::Node& section, const std::string& path,
                             std::uint64_t seed, config::Errors& errors,
                             std::span<const std::string_view> other_keys = {}, bool exact = false);

  /// The same for an update; its declare() throws the InputError for kinds of samples.
  Loaded<Update> make_update(const config::Node& section, const std::string& path,
                             std::uint64_t seed, config::Errors& errors,
                             std::span<const std::string_view> other_keys = {}, bool exact = false);

 private:
  std::vector<std::string> names(std::string_view kind) const;
  std::string searched_text() const;
  std::shared_ptr<const Library> load(std::string_view kind, std::string_view name);
  std::shared_ptr<const Library> load_file(const std::filesystem::path& file);
  template <class Interface>
  Loaded<Interface> make(const config::Node& section, const std::string& path, std::uint64_t seed,
                         std::span<const std::string_view> other_keys, bool exact,
                         config::Errors& errors);

  std::vector<std::filesystem::path> folders_;
  PluginLog log_;
  std::shared_ptr<SampleKinds> sample_kinds_ = std::make_shared<SampleKinds>();
  std::mutex mutex_;
  std::map<std::filesystem::path, std::shared_ptr<const Library>> loaded_;  ///< by canonical path
};

}  // namespace viwo
