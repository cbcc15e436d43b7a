// The files that a configuration names: what it reads must not be replaced by what it writes.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "viwo/config/node.hpp"
#include "viwo/setup/run_setup.hpp"

namespace viwo {

/// The file or folder that a scalar of a resolved configuration is, where paths are absolute; a log
/// may be there as FILE.gz.
std::optional<std::filesystem::path> input_file(const config::Node& scalar);

/// All that are named in it.
std::vector<std::filesystem::path> input_files(const config::Node& resolved);

/// And those whose numbers take their place in what is resolved.
std::vector<std::filesystem::path> input_files(const RunSetup& setup);

/// InputError when `written` is one of them, by whatever name.
void refuse_to_replace(const std::filesystem::path& written,
                       const std::vector<std::filesystem::path>& inputs);

/// The same, and when it lies below one that is a folder: of a file whose place is chosen by
/// itself. Results may lie there, in a folder of their own.
void refuse_to_write_into(const std::filesystem::path& written,
                          const std::vector<std::filesystem::path>& inputs);

/// InputError when one of them is this folder, or lies in it.
void refuse_to_empty(const std::filesystem::path& folder,
                     const std::vector<std::filesystem::path>& inputs);

}  // namespace viwo
