#include "viwo/log/text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <utility>

#include "viwo/api/stamp_order.hpp"
#include "viwo/config/suggest.hpp"
#include "viwo/math/number_text.hpp"
#include "viwo/math/utf8.hpp"

namespace viwo::log {
namespace {

template <class T>
std::optional<T> parse_whole(std::string_view text) {
  text = trim(text);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  T value{};
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc{} || result.ptr != text.data() + text.size()) return std::nullopt;
  return value;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// A decimal number taken apart: value = 0.digits * 10^point, no leading zeros.
struct Decimal {
  bool negative = false;
  std::string digits;
  std::int64_t point = 0;
};

std::optional<Decimal> take_apart(std::string_view text) {
  Decimal out;
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) {
    out.negative = text[0] == '-';
    text.remove_prefix(1);
  }
  const std::size_t exponent_at = text.find_first_of("eE");
  const std::string_view mantissa = text.substr(0, exponent_at);
  std::int64_t exponent = 0;
  if (exponent_at != std::string_view::npos) {
    const auto parsed = parse_whole<std::int64_t>(text.substr(exponent_at + 1));
    if (!parsed || *parsed < -1000 || *parsed > 1000) return std::nullopt;
    exponent = *parsed;
  }
  const std::size_t dot = mantissa.find('.');
  const std::string_view whole = mantissa.substr(0, dot);
  const std::string_view fraction =
      dot == std::string_view::npos ? std::string_view{} : mantissa.substr(dot + 1);
  out.digits.append(whole).append(fraction);
  if (out.digits.empty() || !std::all_of(out.digits.begin(), out.digits.end(), is_digit)) {
    return std::nullopt;
  }
  const std::size_t zeros = std::min(out.digits.find_first_not_of('0'), out.digits.size());
  out.digits.erase(0, zeros);
  out.point = static_cast<std::int64_t>(whole.size()) - static_cast<std::int64_t>(zeros) + exponent;
  return out;
}

/// U+0080 to U+009F, the ends of lines U+2028 and U+2029, and what turns the direction of a text,
/// U+202A to U+202E and U+2066 to U+2069: what follows would be read as something else.
bool ends_a_line_or_controls(std::string_view character) {
  const auto is_of = [character](std::string_view first, std::string_view last) {
    return character.size() == first.size() && character >= first && character <= last;
  };
  return is_of("\xc2\x80", "\xc2\x9f") || is_of("\xe2\x80\xa8", "\xe2\x80\xae") ||
         is_of("\xe2\x81\xa6", "\xe2\x81\xa9");
}

/// "a, b, c"; of a long list the nearest to `name`, and how many more there are. Names are those of
/// a file: of a long one the beginning counts.
std::string list_of(const std::vector<std::string>& candidates, std::string_view name) {
  constexpr std::size_t kLongest = 500;  // an error of a plugin has room for 1000
  constexpr std::size_t kLongestName = 200;
  std::size_t size = 0;
  for (const std::string& candidate : candidates) size += candidate.size() + 2;
  name = name.substr(0, kLongestName);
  std::vector<std::pair<double, std::string_view>> ranked;
  for (const std::string& whole : candidates) {
    const std::string_view candidate = std::string_view(whole).substr(0, kLongestName);
    const double longer =
        static_cast<double>(std::max({candidate.size(), name.size(), std::size_t{1}}));
    const auto off =
        size > kLongest ? static_cast<double>(config::edit_distance(name, candidate)) : 0.;
    ranked.emplace_back(off / longer, candidate);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::string list;
  for (std::size_t i = 0; i < ranked.size(); ++i) {
    const std::string next = (i == 0 ? "" : ", ") + printable(ranked[i].second);
    if (i > 0 && list.size() + next.size() > kLongest) {
      return list + ", ... (" + std::to_string(ranked.size() - i) + " more)";
    }
    list += next;
  }
  return list;
}

}  // namespace

std::string_view trim(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

std::optional<double> parse_number(std::string_view text) { return parse_whole<double>(text); }

std::optional<std::int64_t> parse_integer(std::string_view text) {
  return parse_whole<std::int64_t>(text);
}

std::optional<std::int64_t> parse_time_ns(std::string_view text, TimeUnit unit) {
  const auto decimal = take_apart(trim(text));
  if (!decimal) return std::nullopt;
  // Digits of the number in nanoseconds
  const std::int64_t places = decimal->point + static_cast<std::int64_t>(unit);
  if (decimal->digits.empty() || places < 0) return 0;
  if (places > 19) return std::nullopt;
  const auto kept = static_cast<std::size_t>(places);
  std::string nanoseconds(1, '0');
  nanoseconds += decimal->digits.substr(0, kept);
  nanoseconds.resize(kept + 1, '0');
  const auto value = parse_integer(nanoseconds);
  if (!value || *value > kMaxStampNs) return std::nullopt;
  const bool round_up = decimal->digits.size() > kept && decimal->digits[kept] >= '5';
  const std::int64_t rounded = *value + (round_up ? 1 : 0);
  return decimal->negative ? -rounded : rounded;
}

std::string quoted(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  return "'" + printable(text.substr(0, kLongest)) + (text.size() > kLongest ? "...'" : "'");
}

std::string printable(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string out;
  while (!text.empty()) {
    const auto c = static_cast<unsigned char>(text[0]);
    const std::size_t size = utf8_size(text);
    if (c < 0x20 || c == 0x7f || ends_a_line_or_controls(text.substr(0, size))) {
      out += '?';
    } else if (size > 0) {
      out += text.substr(0, size);
    } else {
      out += {'\\', 'x', kDigits[c >> 4U], kDigits[c & 15U]};
    }
    text.remove_prefix(std::max<std::size_t>(size, 1));
  }
  return out;
}

std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates) {
  if (candidates.empty()) return " - there are none";
  const std::string near = config::nearest(name, candidates);
  if (!near.empty()) return " - did you mean '" + printable(near) + "'?";
  return " - there are: " + list_of(candidates, name);
}

}  // namespace viwo::log
