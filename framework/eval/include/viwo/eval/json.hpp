// Numbers and texts in JSON.
#pragma once

#include <cmath>
#include <string>

#include <nlohmann/json.hpp>

namespace viwo {

/// NaN and infinity, which JSON does not have, become null.
inline nlohmann::json number_or_null(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json();
}

/// The text of a JSON file. What is not UTF-8 in its strings becomes U+FFFD: by itself dump()
/// throws then, and all results would be lost for the name of a file.
inline std::string json_text(const nlohmann::json& value) {
  return value.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace viwo
