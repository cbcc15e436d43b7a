// Text as HTML wants it.
#pragma once

#include <string>
#include <string_view>

#include "viwo/report/document.hpp"

namespace viwo::report {

/// `text` for use between tags and in quoted attributes.
std::string escaped(std::string_view text);

/// A number for people; an en dash when it is not finite.
std::string formatted(double value, const NumberFormat& format);

/// Base64 with padding (RFC 4648).
std::string base64(std::string_view bytes);

}  // namespace viwo::report
