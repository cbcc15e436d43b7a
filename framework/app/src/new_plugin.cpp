#include "new_plugin.hpp"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "viwo/api/build_record.hpp"
#include "viwo/api/status.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/files/files.hpp"
#include "viwo/plugin_host/installation.hpp"

namespace viwo::app {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestName = 40;
constexpr std::string_view kTemplateSuffix = ".in";

using Replacements = std::vector<std::pair<std::string, std::string>>;

void check_kind(const std::string& kind) {
  const std::vector<std::string> kinds{"kinematics", "sensor", "update"};
  if (std::find(kinds.begin(), kinds.end(), kind) == kinds.end()) {
    throw InputError("viwo plugins new: unknown kind '" + kind + "'" +
                     config::did_you_mean(kind, kinds));
  }
}

bool is_lower(char c) { return c >= 'a' && c <= 'z'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// A name becomes part of a file name, of a CMake target and of a class name.
void check_name(const std::string& name) {
  bool good = !name.empty() && name.size() <= kLongestName && is_lower(name.front()) &&
              name.back() != '_' && name.find("__") == std::string::npos;
  for (const char c : name) good = good && (is_lower(c) || is_digit(c) || c == '_');
  if (good) return;
  throw InputError("viwo plugins new: '" + name +
                   "' is no name for a plugin: lower-case letters, digits and single underscores, "
                   "a letter first, at most " +
                   std::to_string(kLongestName) + " of them, e.g. my_tricycle");
}

void check_not_taken(PluginRegistry& plugins, const std::string& kind, const std::string& name) {
  const std::string file_name = "libviwo_" + kind + "_" + name + ".so";
  for (const PluginListing& listing : plugins.list()) {
    if (listing.file.filename() != file_name) continue;
    throw InputError("viwo plugins new: there is a " + kind + " plugin '" + name +
                     "' already: " + listing.file.string() + " - choose another name");
  }
}

/// "my_base" -> "MyBase"
std::string class_name(const std::string& name) {
  std::string text;
  bool upper = true;
  for (const char c : name) {
    if (c != '_') {
      text += upper ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
    }
    upper = c == '_';
  }
  return text;
}

fs::path template_folder() {
  std::error_code error;
  fs::path folder = installation_prefix() / "share/viwo/templates";
  if (!fs::is_directory(folder, error)) {
    throw InputError("viwo plugins new: no templates in " + folder.string() +
                     " - they come with the Debian package viwo-dev");
  }
  return folder;
}

std::string replaced(std::string text, const Replacements& replacements) {
  for (const auto& [from, to] : replacements) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
      text.replace(at, from.size(), to);
    }
  }
  return text;
}

void copy_template(const fs::path& from, const fs::path& to, const Replacements& replacements) {
  std::ifstream source(from, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(source), {}};
  if (!source) throw std::runtime_error("cannot read " + from.string());
  files::write_bytes(to, replaced(text, replacements));
}

}  // namespace

void write_new_plugin(PluginRegistry& plugins, const std::string& kind, const std::string& name,
                      const fs::path& folder) {
  check_kind(kind);
  check_name(name);
  check_not_taken(plugins, kind, name);
  const fs::path templates = template_folder();
  std::error_code error;
  if (fs::exists(fs::symlink_status(folder, error))) {
    throw InputError("viwo plugins new: " + folder.string() + " exists: nothing was written");
  }
  if (!fs::create_directories(folder, error)) {
    throw InputError("viwo plugins new: cannot make the folder " + folder.string() +
                     (error ? ": " + error.message() : ""));
  }
  const Replacements replacements = {{"@name@", name},
                                     {"@Name@", class_name(name)},
                                     {"@kind@", kind},
                                     {"@version@", VIWO_VERSION},
                                     {"@api@", std::to_string(kApiVersion)}};
  try {
    for (const fs::path& part : {templates / "common", templates / kind}) {
      for (const fs::directory_entry& entry : fs::directory_iterator(part)) {
        std::string file = replaced(entry.path().filename().string(), replacements);
        if (!file.ends_with(kTemplateSuffix)) continue;
        file.resize(file.size() - kTemplateSuffix.size());
        copy_template(entry.path(), folder / file, replacements);
      }
    }
  } catch (...) {
    fs::remove_all(folder, error);  // half a plugin would be in the way of a whole one
    throw;
  }
}

}  // namespace viwo::app
