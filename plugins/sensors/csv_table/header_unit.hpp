// The unit that a header says a column is in.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

namespace viwo::csv_table {

enum class Quantity { kAngle, kRate, kLength, kSpeed, kTime };

/// 1 of it, in rad, rad/s, m, m/s or s.
struct HeaderUnit {
  const char* name;
  Quantity of;
  double si;
};

inline constexpr double kDegree = M_PI / 180., kTurn = 2. * M_PI;
inline constexpr HeaderUnit kHeaderUnits[] = {
    {"rad", Quantity::kAngle, 1.},       {"deg", Quantity::kAngle, kDegree},
    {"turn", Quantity::kAngle, kTurn},   {"rev", Quantity::kAngle, kTurn},
    {"rad/s", Quantity::kRate, 1.},      {"deg/s", Quantity::kRate, kDegree},
    {"dps", Quantity::kRate, kDegree},   {"rpm", Quantity::kRate, kTurn / 60.},
    {"turn/s", Quantity::kRate, kTurn},  {"rev/s", Quantity::kRate, kTurn},
    {"rps", Quantity::kRate, kTurn},     {"m", Quantity::kLength, 1.},
    {"cm", Quantity::kLength, 1e-2},     {"mm", Quantity::kLength, 1e-3},
    {"m/s", Quantity::kSpeed, 1.},       {"cm/s", Quantity::kSpeed, 1e-2},
    {"mm/s", Quantity::kSpeed, 1e-3},    {"km/h", Quantity::kSpeed, 1. / 3.6},
    {"kmh", Quantity::kSpeed, 1. / 3.6}, {"kph", Quantity::kSpeed, 1. / 3.6},
    {"mph", Quantity::kSpeed, 0.44704},  {"s", Quantity::kTime, 1.},
    {"ms", Quantity::kTime, 1e-3},       {"us", Quantity::kTime, 1e-6},
    {"ns", Quantity::kTime, 1e-9},
};

/// Of "v_left [km/h]", "drive 1 (deg s^-1)"; nothing where there is none, or none that is known.
inline std::optional<HeaderUnit> unit_of_header(std::string_view header) {
  if (header.empty() || (header.back() != ']' && header.back() != ')')) return {};
  const std::size_t begin = header.rfind(header.back() == ']' ? '[' : '(');
  if (begin == std::string_view::npos) return {};
  std::string text(header.substr(begin + 1, header.size() - begin - 2));
  std::erase(text, ' ');
  constexpr std::string_view kPerSecond = "s^-1";
  if (text.ends_with(kPerSecond)) text.replace(text.size() - kPerSecond.size(), 4, "/s");
  const auto* const known = std::find_if(std::begin(kHeaderUnits), std::end(kHeaderUnits),
                                         [&](const HeaderUnit& unit) { return text == unit.name; });
  return known != std::end(kHeaderUnits) ? std::optional(*known) : std::nullopt;
}

}  // namespace viwo::csv_table
