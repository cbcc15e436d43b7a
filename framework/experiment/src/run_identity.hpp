// What decides the result of a run beside its seed: by content, wherever it lies.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "viwo/run/run.hpp"

namespace viwo::experiment {

/// Tells runs of the same inputs. Reads each file once. Not for several threads at once.
class RunIdentity {
 public:
  /// `results`: a folder that changes while runs are made, though it may lie among their inputs.
  explicit RunIdentity(const std::filesystem::path& results)
      : results_(std::filesystem::weakly_canonical(results)) {}

  /// Version, program, libraries of plugins, and the resolved configuration; each file or folder
  /// that these name stands there as size and checksum. std::runtime_error for one that cannot be
  /// read.
  std::string of(const RunSetup& run);

 private:
  const std::string& content_of(const std::filesystem::path& path);
  void replace_paths(config::Node& node);

  std::filesystem::path results_;
  std::map<std::filesystem::path, std::string> contents_;
};

}  // namespace viwo::experiment
