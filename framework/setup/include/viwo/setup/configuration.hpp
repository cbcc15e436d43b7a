// Configuration of a run, an experiment or a calibration: files, overrides, placeholders.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "viwo/api/status.hpp"
#include "viwo/config/node.hpp"

namespace viwo {

/// One element of the axis that an experiment or a calibration runs over: a recording, a simulated
/// motion. Its labels are placeholders ({recording}, {motion}, ...) of the base configuration.
struct Recording {
  std::string name;
  std::map<std::string, std::string> labels;
  config::Mark mark = {};  ///< where it is named
};

/// What `read` returns; its InputErrors say while which recording is read, where it has a name.
template <class Read>
auto of_recording(const Recording& recording, const Read& read) {
  try {
    return read();
  } catch (const InputError& error) {
    if (recording.name.empty()) throw;
    throw InputError(std::string(error.what()) + "\n" + recording.mark.text() +
                     "  while reading recording '" + recording.name + "'");
  }
}

/// A run configuration, with `--set` assignments ("path.to.key=VALUE") applied. Placeholders are
/// still in it. Throws InputError, also for a placeholder that is given a value and used nowhere.
config::Node load_run_configuration(const std::filesystem::path& file,
                                    const std::vector<std::string>& assignments);

/// Replaces the placeholders of a run configuration: those of its section `placeholders`, overruled
/// by `labels`. Throws InputError for one that has no value.
config::Node resolve_placeholders(const config::Node& run,
                                  const std::map<std::string, std::string>& labels = {});

/// The list `recordings` (names, numbers or maps of labels) or `motions` (names, or maps of labels)
/// of an experiment or a calibration; one element without labels if there is neither. Throws
/// InputError.
std::vector<Recording> read_recordings(const config::Node& section);

/// The run configuration that an experiment or a calibration is based on: its file `base` (relative
/// to its folder), its section `set` of overrides, then `assignments`. Throws InputError, also for
/// a placeholder that is given a value, by a variant or as a label, and that no variant uses; what
/// else is wrong with the recordings is for read_recordings(), before this.
config::Node load_base(const config::Node& configuration,
                       const std::vector<std::string>& assignments);

/// Throws InputError at `key` of `configuration` when no recording has one of the labels.
void require_labels(const std::vector<std::string>& labels,
                    const std::vector<Recording>& recordings, const config::Node& configuration,
                    const char* key);

/// Throws InputError unless `name` can be a file name: letters, digits, '_', '-', '+', '.', not
/// first.
void require_file_name(const std::string& name, const config::Mark& mark);

}  // namespace viwo
