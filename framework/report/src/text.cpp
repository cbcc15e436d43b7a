#include "text.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace viwo::report {

namespace {

constexpr std::string_view kEnDash = "\xe2\x80\x93";

/// Beyond this, doubles no longer tell neighbouring whole numbers apart.
constexpr double kMaxWhole = 9007199254740992.;

}  // namespace

std::string escaped(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      case '\'':
        result += "&#39;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::string formatted(double value, const NumberFormat& format) {
  if (!std::isfinite(value)) return std::string(kEnDash);
  if (value == 0.) value = 0.;  // no "-0"
  auto style = std::chars_format::fixed;
  int digits = format.digits;
  if (format.style == NumberFormat::Style::kSignificant) {
    if (value == std::trunc(value) && std::abs(value) <= kMaxWhole) {
      digits = 0;
    } else {
      style = std::chars_format::general;
    }
  }
  // The longest double in fixed notation has 309 digits before the point.
  std::array<char, 400> buffer{};
  const auto [end, error] =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, style, digits);
  if (error != std::errc()) return std::string(kEnDash);
  std::string text(buffer.data(), end);
  // Also when rounding is what made it zero.
  if (text.find_first_not_of("-0.") == std::string::npos && text.front() == '-') text.erase(0, 1);
  return text;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string result;
  result.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = bytes.size() - i < 3 ? bytes.size() - i : 3;
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = group << 8 | (k < n ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      result += k <= n ? kDigits[group >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return result;
}

}  // namespace viwo::report
