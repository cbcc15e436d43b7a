#include "units.hpp"

#include <array>

namespace viwo::config {
namespace {

constexpr std::array<std::string_view, 31> kUnits = {
    "m",          "mm",       "cm",  "km",  "rad",       "deg",       "s",        "ms",
    "us",         "ns",       "min", "hz",  "khz",       "m_per_s",   "mps",      "mm_per_s",
    "cm_per_s",   "km_per_h", "kmh", "rpm", "rad_per_s", "deg_per_s", "m_per_s2", "rad_per_s2",
    "deg_per_s2", "kg",       "g",   "n",   "px",        "percent",   "rev_per_s"};

}  // namespace

KeyUnit split_unit(std::string_view key) {
  KeyUnit longest{key, {}};
  for (const std::string_view unit : kUnits) {
    if (unit.size() <= longest.suffix.size() || key.size() < unit.size() + 2) continue;
    if (!key.ends_with(unit) || key[key.size() - unit.size() - 1] != '_') continue;
    longest = {key.substr(0, key.size() - unit.size() - 1), unit};
  }
  return longest;
}

std::string unit_text(std::string_view suffix) {
  const std::size_t per = suffix.find("_per_");
  std::string text{suffix.substr(0, per)};
  if (per != std::string_view::npos) text.append("/").append(suffix.substr(per + 5));
  return text;
}

}  // namespace viwo::config
