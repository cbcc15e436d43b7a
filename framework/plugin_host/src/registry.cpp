#include "viwo/plugin_host/registry.hpp"

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <set>
#include <system_error>
#include <utility>

#include "library.hpp"
#include "plugin_file.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/plugin_host/installation.hpp"

namespace viwo {
namespace {

namespace fs = std::filesystem;

/// The *.so in a folder, sorted by name; with `error` those before it.
std::vector<fs::path> libraries_in(const fs::path& folder, std::error_code& error) {
  std::vector<fs::path> files;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (it->path().extension() == ".so") files.push_back(it->path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

bool is_not_there(const std::error_code& error) {
  return error == std::errc::no_such_file_or_directory || error == std::errc::not_a_directory;
}

void log_to_stderr(const PluginInfo& info, LogLevel level, std::string_view text) {
  const char* const prefix = level == LogLevel::kWarning ? "warning: " : "";
  std::cerr << prefix + info.name + ": " + std::string(text) + "\n";
}

fs::path canonical_or_same(const fs::path& file) {
  std::error_code error;
  const fs::path canonical = fs::canonical(file, error);
  return error ? file : canonical;
}

/// The Debian package of a plugin of viwo that the package viwo leaves to others, for what it
/// links; empty for any other (framework/cmake/viwo_packages.cmake; packages.check compares).
std::string_view package_of(std::string_view kind, std::string_view name) {
  if (kind != "sensor") return {};
  for (const char* const own : {"ros1_bag", "ros1_topics", "ros2_bag", "ros2_topics"}) {
    if (name == own) return "viwo-ros";
  }
  for (const char* const own : {"asl_images", "kaist_urban", "klt_tracker"}) {
    if (name == own) return "viwo-images";
  }
  if (name == "video") return "viwo-show";
  return {};
}

}  // namespace

PluginRegistry::PluginRegistry(std::vector<fs::path> folders, PluginLog log)
    : folders_(std::move(folders)), log_(log ? std::move(log) : log_to_stderr) {}

PluginRegistry::~PluginRegistry() = default;

std::vector<fs::path> PluginRegistry::default_search_path(const std::vector<fs::path>& extra) {
  for (const fs::path& folder : extra) {
    std::error_code error;
    if (!fs::is_directory(folder, error)) {
      throw InputError("--plugin-path " + folder.string() + ": no such folder");
    }
  }
  std::vector<fs::path> folders = extra;
  if (const char* variable = std::getenv("VIWO_PLUGIN_PATH")) {
    std::string_view rest = variable;
    while (!rest.empty()) {
      const std::size_t colon = std::min(rest.find(':'), rest.size());
      if (colon > 0) folders.emplace_back(rest.substr(0, colon));
      rest.remove_prefix(std::min(colon + 1, rest.size()));
    }
  }
  const fs::path prefix = installation_prefix();
  if (!prefix.empty()) {
    folders.push_back(prefix / "lib/viwo/plugins" /
                      std::string("v").append(std::to_string(kApiVersion)));
  }
  return folders;
}

std::vector<std::string> PluginRegistry::names(std::string_view kind) const {
  std::set<std::string> names;
  for (const fs::path& folder : folders_) {
    std::error_code ignored;  // they are suggestions
    for (const fs::path& file : libraries_in(folder, ignored)) {
      const auto parsed = parse_file_name(file);
      if (parsed && parsed->kind == kind) names.insert(parsed->name);
    }
  }
  return {names.begin(), names.end()};
}

std::string PluginRegistry::searched_text() const {
  if (folders_.empty()) return " (no folder to search)";
  std::string text;
  for (const fs::path& folder : folders_) {
    text += (text.empty() ? " (searched " : ", ") + folder.string();
    std::error_code error;
    if (!fs::is_directory(folder, error)) text += " [no such folder]";
  }
  return text + ")";
}

std::shared_ptr<const Library> PluginRegistry::load_file(const fs::path& file) {
  const fs::path key = canonical_or_same(file);
  const std::lock_guard lock(mutex_);
  // A link of another name is judged by its own name, hence loaded anew.
  const auto found = loaded_.find(key);
  if (found != loaded_.end() && found->second->info().file.filename() == file.filename()) {
    return found->second;
  }
  auto library = std::make_shared<const Library>(file);
  keep_until_exit(library);
  loaded_.insert_or_assign(key, library);
  return library;
}

std::shared_ptr<const Library> PluginRegistry::load(std::string_view kind, std::string_view name) {
  const std::string file_name = make_file_name(std::string(kind), std::string(name));
  const std::string what = std::string(kind) + " plugin '" + std::string(name) + "'";
  fs::path found;
  for (const fs::path& folder : folders_) {
    const fs::path file = folder / file_name;
    std::error_code error;
    if (!fs::exists(fs::symlink_status(file, error))) continue;
    if (found.empty()) {
      found = file;
    } else if (canonical_or_same(found) != canonical_or_same(file)) {
      throw InputError("two files for the " + what + ": " + found.string() + " and " +
                       file.string() + " - remove one, or its folder from the search path");
    }
  }
  if (found.empty()) {
    if (const std::string_view package = package_of(kind, name); !package.empty()) {
      throw InputError("no " + what + " - it comes with the Debian package " +
                       std::string(package) + "; a build without its libraries leaves it out" +
                       searched_text());
    }
    throw InputError("no " + what + config::did_you_mean(name, names(kind)) + searched_text());
  }
  return load_file(fastest_copy(found));
}

PluginInfo PluginRegistry::find(std::string_view kind, std::string_view name) {
  return load(kind, name)->info();
}

PluginInfo PluginRegistry::check(const fs::path& file) { return load_file(file)->info(); }

std::vector<PluginListing> PluginRegistry::list() {
  std::vector<PluginListing> listings;
  std::set<fs::path> seen;
  for (const fs::path& folder : folders_) {
    std::error_code error;
    const std::vector<fs::path> files = libraries_in(folder, error);
    if (error && !is_not_there(error)) {
      listings.push_back({folder, std::nullopt, "cannot be read: " + error.message(), true});
    }
    for (const fs::path& file : files) {
      if (!seen.insert(fs::weakly_canonical(folder) / file.filename()).second) continue;
      PluginListing& listing = listings.emplace_back();
      listing.file = file;
      try {
        listing.info = check(file);
      } catch (const PluginRefused& refused) {
        listing.refusal = refused.reason();
        listing.is_unavailable = dynamic_cast<const PluginUnavailable*>(&refused) != nullptr;
      }
    }
  }
  return listings;
}

}  // namespace viwo
