// Numbers and short texts as they stand in log files.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace viwo::log {

/// Without blanks and tabs at both ends.
std::string_view trim(std::string_view text);

/// The whole text as a number ("nan" and "inf" included); nothing when it is not one.
std::optional<double> parse_number(std::string_view text);
std::optional<std::int64_t> parse_integer(std::string_view text);

/// By how many powers of ten a unit of time is longer than a nanosecond.
enum class TimeUnit : std::uint8_t {
  kNanosecond = 0,
  kMicrosecond = 3,
  kMillisecond = 6,
  kSecond = 9
};

/// A decimal time, with or without exponent, as nanoseconds: exact, not through a double; digits
/// below the nanosecond are rounded. Nothing when it is not a number or beyond +-4e18 ns.
std::optional<std::int64_t> parse_time_ns(std::string_view text, TimeUnit unit);
inline std::optional<std::int64_t> parse_seconds_ns(std::string_view text) {
  return parse_time_ns(text, TimeUnit::kSecond);
}

/// For messages and tables: control characters, also those of the direction, are '?', bytes that
/// are no UTF-8 "\xff".
std::string printable(std::string_view text);
/// The same in quotes, cut after 40 characters.
std::string quoted(std::string_view text);

/// " - did you mean 'x'?" for the candidate at an edit distance of at most 2, otherwise
/// " - there are: a, b, c": of a long list the nearest, and how many more.
std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates);

}  // namespace viwo::log
