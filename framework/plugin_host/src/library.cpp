#include "library.hpp"

#include <cfenv>
#include <cstdlib>
#include <limits>
#include <mutex>
#include <new>
#include <string>
#include <system_error>
#include <vector>

#include <boost/dll/runtime_symbol_info.hpp>
#include <dlfcn.h>

#include "library_pages.hpp"
#include "plugin_digest.hpp"
#include "plugin_file.hpp"
#include "viwo/config/params.hpp"
#include "viwo/plugin_host/build_record_check.hpp"

namespace viwo {
namespace {

constexpr const char* kSymbol = "viwo_plugin";

/// How this thread computes: rounding, and whether tiny results become zero.
struct FloatingPointMode {
  int rounding = std::fegetround();
  bool keeps_subnormals = true;

  FloatingPointMode() {
    volatile double smallest_normal = std::numeric_limits<double>::min();
    volatile double half = smallest_normal / 2.;
    keeps_subnormals = half > 0.;
  }
  bool operator==(const FloatingPointMode&) const = default;
};

/// Libraries linked with -ffast-math change the mode of the thread that loads them.
class KeepFloatingPointMode {
 public:
  KeepFloatingPointMode() = default;
  ~KeepFloatingPointMode() { std::fesetenv(&environment_); }
  KeepFloatingPointMode(const KeepFloatingPointMode&) = delete;
  KeepFloatingPointMode& operator=(const KeepFloatingPointMode&) = delete;

  bool is_changed() const { return !(mode_ == FloatingPointMode()); }

 private:
  static std::fenv_t current() {
    std::fenv_t environment;
    std::fegetenv(&environment);
    return environment;
  }

  // In this order: finding out the mode raises floating-point flags.
  std::fenv_t environment_ = current();
  FloatingPointMode mode_;
};

/// The version that was found well.
FileVersion check_bytes(const std::filesystem::path& file) {
  const auto [bytes, version] = read_library(file);
  const std::string record = build_record_in(bytes, file);
  const auto differences = compare_build_records(api_build_record(), record);
  if (!differences.empty()) throw PluginRefused(file, explain(differences));
  if (digest_in(record) == digest_in(api_build_record())) {
    throw PluginRefused(file,
                        "has no digest in its build record - build it with viwo_add_plugin(), or "
                        "run viwo_seal FILE after the link");
  }
  if (digest_in(record) != plugin_digest(bytes)) {
    throw PluginRefused(file,
                        "is damaged, or was changed after it was linked: the digest in its build "
                        "record is that of other bytes - copy or build it again");
  }
  return version;
}

PluginUnavailable changed(const std::filesystem::path& file) {
  return {file, "was replaced or written into while it was loaded - try again"};
}

bool is_loaded(const std::filesystem::path& file) {
  void* const handle = ::dlopen(file.c_str(), RTLD_LAZY | RTLD_NOLOAD);
  if (handle != nullptr) ::dlclose(handle);
  return handle != nullptr;
}

/// Profilers know code by the file that it is mapped from (DEVELOPERS.md).
bool stays_mapped() { return std::getenv("VIWO_PLUGINS_STAY_MAPPED") != nullptr; }

}  // namespace

Library::Library(const std::filesystem::path& file) {
  const FileVersion version = check_bytes(file);
  {
    // Of two registries one loads it, and has copied it when the other one may run in it.
    static std::mutex mutex;
    const std::lock_guard lock(mutex);
    const bool is_first = load(file, version);
    find_descriptor(file);
    if (is_first && !stays_mapped()) keep_pages(file);
    if (version_of(file) != version) throw changed(file);
  }
  check_descriptor(file);
  const PluginDescriptor& d = *descriptor_;
  info_ = {d.kind, d.name, d.version, d.summary, d.license, file, d.params()};
}

bool Library::load(const std::filesystem::path& file, const FileVersion& version) {
  const KeepFloatingPointMode keep;
  bool is_first = false;
  try {
    const std::filesystem::path real = std::filesystem::canonical(file);
    is_first = !is_loaded(real);
    if (version_of(real) != version) throw changed(file);
    library_.load(real, boost::dll::load_mode::rtld_now | boost::dll::load_mode::rtld_local);
  } catch (const std::system_error& error) {
    throw PluginUnavailable(file, std::string("cannot be loaded: ") + error.what() +
                                      "\n  -> link what is missing; viwo_add_plugin() shows "
                                      "undefined symbols when it links");
  }
  if (keep.is_changed()) {
    throw PluginRefused(file,
                        "changes the floating-point mode of the process when it is loaded - link "
                        "it without -ffast-math and -Ofast");
  }
  return is_first;
}

void Library::find_descriptor(const std::filesystem::path& file) {
  const std::string remedy = " - add VIWO_REGISTER(...) to one of its sources";
  if (!library_.has(kSymbol)) {
    throw PluginRefused(file, "registers no plugin (it has no symbol 'viwo_plugin')" + remedy);
  }
  descriptor_ = &library_.get<const PluginDescriptor>(kSymbol);
  std::error_code error;
  const std::filesystem::path location = boost::dll::symbol_location_ptr(descriptor_, error);
  if (!error && std::filesystem::equivalent(location, file, error)) return;
  if (error) throw PluginUnavailable(file, "cannot be looked at: " + error.message());
  throw PluginRefused(file, "registers no plugin: the symbol 'viwo_plugin' it sees is that of " +
                                location.string() + remedy +
                                ", and do not link one plugin to another");
}

void Library::keep_pages(const std::filesystem::path& file) const {
  try {
    keep_pages_of(descriptor_, file);
  } catch (const std::system_error& error) {
    throw PluginUnavailable(file, std::string("cannot be copied to memory: ") + error.what() +
                                      "\n  -> with VIWO_PLUGINS_STAY_MAPPED=1 in the environment "
                                      "it is not, and must not be overwritten while it is used");
  }
}

void Library::check_descriptor(const std::filesystem::path& file) const {
  const PluginDescriptor& d = *descriptor_;
  if (d.struct_size < sizeof(PluginDescriptor)) {
    throw PluginRefused(
        file, "has a descriptor of " + std::to_string(d.struct_size) + " bytes, this host needs " +
                  std::to_string(sizeof(PluginDescriptor)) + " - rebuild it against this viwo");
  }
  if (d.api_version != kApiVersion) {
    throw PluginRefused(file, "is for version " + std::to_string(d.api_version) +
                                  " of the plugin API, this host has version " +
                                  std::to_string(kApiVersion) + " - rebuild it against this viwo");
  }
  for (const char* text : {d.kind, d.name, d.version, d.summary, d.license}) {
    if (text == nullptr) {
      throw PluginRefused(file, "has a descriptor with a null text - use VIWO_REGISTER(...)");
    }
  }
  if (d.create == nullptr || d.destroy == nullptr || d.params == nullptr) {
    throw PluginRefused(file, "has a descriptor with a null pointer - use VIWO_REGISTER(...)");
  }
  const auto expected = parse_file_name(file);
  if (!expected || expected->kind != d.kind || expected->name != d.name) {
    throw PluginRefused(file, "registers '" + std::string(d.name) + "' of kind '" + d.kind +
                                  "' - its file must be named " + make_file_name(d.kind, d.name));
  }
  try {
    config::check_specs(d.params());
  } catch (const std::bad_alloc&) {  // no fault of the plugin
    throw;
  } catch (const std::exception& error) {
    throw PluginRefused(file, std::string("has a wrong parameter table: ") + error.what());
  }
  for (const ParamSpec& spec : d.params()) {
    if (spec.name == "type") {
      throw PluginRefused(file,
                          "has a wrong parameter table: 'type' is taken, it names the plugin");
    }
  }
}

void keep_until_exit(std::shared_ptr<const Library> library) {
  static std::mutex mutex;
  // Never destroyed: objects of static storage may still use a plugin while the process exits.
  static auto& kept = *new std::vector<std::shared_ptr<const Library>>();
  const std::lock_guard lock(mutex);
  kept.push_back(std::move(library));
}

}  // namespace viwo
