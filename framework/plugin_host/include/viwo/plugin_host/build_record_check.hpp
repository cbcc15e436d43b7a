// Comparing how host and plugin were built, from the bytes of the plugin's file: nothing of it
// runs.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "viwo/api/build_record.hpp"

namespace viwo {

/// The complete build records in `bytes`, without repetitions, at most two: more than one is too
/// many. A bare kBuildRecordBegin, as it is in the constants of this very program, is none.
std::vector<std::string> find_build_records(std::string_view bytes);

/// The build record in the bytes of a plugin's file. Throws PluginRefused when it has none, or
/// several that disagree.
std::string build_record_in(std::string_view bytes, const std::filesystem::path& file);

struct RecordDifference {
  std::string field;
  std::string host;
  std::string plugin;
  bool operator==(const RecordDifference&) const = default;
};

/// The fields that differ, in the order of the host's record; "(missing)" where one has no such
/// field. The digest is each file's own.
std::vector<RecordDifference> compare_build_records(std::string_view host, std::string_view plugin);

/// Reason of a refusal: every field, and what to do about it. `differences` must not be empty.
std::string explain(const std::vector<RecordDifference>& differences);

/// Whether the caller was compiled like libviwo_api.so; an application checks itself at start.
bool host_record_is_consistent(std::string_view own = {kBuildRecord.text.data(),
                                                       kBuildRecord.size});

}  // namespace viwo
