// A run's result as JSON, from which it comes back bit for bit.
#pragma once

#include <nlohmann/json.hpp>

#include "viwo/run/run.hpp"

namespace viwo {

/// All that thin() leaves. Numbers that are not finite stay what they are.
nlohmann::json to_record(const RunResult& run);

/// Throws nlohmann::json::exception or std::invalid_argument for something that to_record() cannot
/// have made: series that belong together are of one length, times go forward, poses are finite.
RunResult from_record(const nlohmann::json& record);

}  // namespace viwo
