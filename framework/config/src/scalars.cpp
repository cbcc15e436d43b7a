#include "scalars.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "viwo/math/number_text.hpp"

namespace viwo::config {
namespace {

/// from_chars takes no leading '+'; people do write it.
const char* skip_plus(const std::string& text) {
  const bool plus = text.size() > 1 && text[0] == '+' && text[1] != '-' && text[1] != '+';
  return text.data() + (plus ? 1 : 0);
}

/// What probably happened when a number is followed by `rest`.
std::string advice(std::string_view rest, const ParamSpec& spec) {
  if (rest.size() > 1 && rest[0] == ',' && rest[1] >= '0' && rest[1] <= '9') {
    return " - the decimal sign is a point";
  }
  const std::string_view unit = spec.unit;
  if (unit.empty()) return " - write the number alone";
  return " - write the number alone, it is in " + std::string(unit);
}

bool is_non_finite(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  if (text.starts_with('+') || text.starts_with('-')) text.erase(0, 1);
  if (text.starts_with('.')) text.erase(0, 1);
  return text == "nan" || text == "inf" || text == "infinity";
}

template <class T>
Parsed<T> parse(const std::string& text, const ParamSpec& spec, const std::string& kind) {
  if (is_non_finite(text)) return "'" + text + "' is not a finite number";
  T value{};
  const char* end = text.data() + text.size();
  const auto result = std::from_chars(skip_plus(text), end, value);
  if (result.ec == std::errc::result_out_of_range && result.ptr == end) {
    return "'" + text + "' is outside of what a computer number can hold";
  }
  if (result.ec == std::errc{} && result.ptr == end) return value;
  std::string message = "'" + text + "' is not " + kind;
  if (result.ec == std::errc{}) {
    // 1.5 for an integer is a number, with nothing to say about its unit.
    double number = 0.;
    const auto whole = std::from_chars(skip_plus(text), end, number);
    if (whole.ptr != end) message += advice(std::string_view(whole.ptr, end), spec);
  }
  return message;
}

}  // namespace

Parsed<double> parse_number(const std::string& text, const ParamSpec& spec) {
  return parse<double>(text, spec, "a number");
}

Parsed<std::int64_t> parse_integer(const std::string& text, const ParamSpec& spec) {
  return parse<std::int64_t>(text, spec, "an integer");
}

Parsed<bool> parse_bool(const std::string& text) {
  if (text == "true" || text == "True" || text == "TRUE") return true;
  if (text == "false" || text == "False" || text == "FALSE") return false;
  return "'" + text + "' is not true or false";
}

std::string bounds_text(const ParamSpec& spec) {
  const std::string name = spec.name;
  const bool has_min = std::isfinite(spec.lowest());
  const bool has_max = std::isfinite(spec.max);
  if (!has_min && !has_max) return "";
  const std::string max = has_max ? " <= " + number_text(spec.max) : "";
  if (!has_min) return name + max;
  if (!has_max)
    return name + (spec.excludes_lowest() ? " > " : " >= ") + number_text(spec.lowest());
  return number_text(spec.lowest()) + (spec.excludes_lowest() ? " < " : " <= ") + name + max;
}

bool within_bounds(double value, const ParamSpec& spec) {
  return value >= spec.min && value > spec.above && value <= spec.max;
}

std::string meaning_text(const ParamSpec& spec) {
  std::string text = spec.help;
  if (!spec.unit.empty()) text += (text.empty() ? "" : ", ") + spec.unit;
  return text.empty() ? text : " (" + text + ")";
}

}  // namespace viwo::config
