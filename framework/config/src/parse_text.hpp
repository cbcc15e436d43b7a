// The YAML parser behind parse(), for texts that are not files as well.
#pragma once

#include <string>
#include <string_view>

#include "viwo/config/node.hpp"

namespace viwo::config {

/// As parse(); without positions every mark is the bare origin.
Node parse_text(std::string_view text, const std::string& origin, bool with_positions);

}  // namespace viwo::config
