// Numbers from and to text, independent of the locale.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

#include "viwo/api/params.hpp"

namespace viwo::config {

/// The value, or what is wrong with the text ("'x' is not a number").
template <class T>
using Parsed = std::variant<T, std::string>;

/// A finite number. `spec` gives the unit for the advice when one was written after the number.
Parsed<double> parse_number(const std::string& text, const ParamSpec& spec);
Parsed<std::int64_t> parse_integer(const std::string& text, const ParamSpec& spec);
Parsed<bool> parse_bool(const std::string& text);

/// Shortest text that reads back to the same bits.

/// "track_m > 0", "0 <= track_m < 1", ...; "" without bounds.
std::string bounds_text(const ParamSpec& spec);

/// Whether `value` is inside the bounds of `spec`.
bool within_bounds(double value, const ParamSpec& spec);

/// " (help, unit)", or "".
std::string meaning_text(const ParamSpec& spec);

}  // namespace viwo::config
