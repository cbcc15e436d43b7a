// Numbers in JSON.
#pragma once

#include <cmath>

#include <nlohmann/json.hpp>

namespace viwo {

/// NaN and infinity, which JSON does not have, become null.
inline nlohmann::json number_or_null(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json();
}

}  // namespace viwo
