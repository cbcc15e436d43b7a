// Conformance of a plugin to the contract of viwo/api: named checks, each with an answer that says
// what is wrong, with numbers, and what to do.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "viwo/plugin_host/plugin_info.hpp"

namespace viwo::conformance {

/// What a check found. No failure: passed.
struct CheckResult {
  std::string name;  ///< "derivatives by the intrinsics"
  std::vector<std::string> failures;
  std::vector<std::string> notes;     ///< what is worth knowing, and what could not be checked
  std::vector<std::string> warnings;  ///< what is allowed, and more often a mistake
  std::string skipped = {};           ///< why it was left out; empty: it was not
  bool passed() const { return failures.empty(); }
};

struct Options {
  /// A YAML file in which a section says `type: NAME` of the plugin, for parameters that have no
  /// default; that of a run will do. Without it values are made up, where that is possible.
  std::optional<std::filesystem::path> config;
  /// Where the other plugins are that the section names (`kinematics: {type: ...}`); the folder of
  /// the file comes first.
  std::vector<std::filesystem::path> plugin_path;
  /// Each check runs in a process of its own, which is ended after this time.
  int time_limit_s = 120;
};

struct Conformance {
  PluginInfo plugin;
  std::vector<CheckResult> checks;
  bool passed() const;
};

/// Runs every check that there is for the plugin's kind. Crashes and exceptions of the plugin are
/// failures of the check in which they happen. Throws PluginRefused when the file is not loaded,
/// InputError when `config` cannot be used.
Conformance check_plugin(const std::filesystem::path& file, const Options& options = {});

/// "ok      NAME", "FAILED  NAME" or "skipped NAME" and a line for each failure and warning;
/// `verbose`: notes too.
std::string to_text(const CheckResult& result, bool verbose = false);

}  // namespace viwo::conformance
