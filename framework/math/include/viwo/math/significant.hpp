// Numbers as texts for people.
#pragma once

#include <array>
#include <cmath>
#include <cstdio>
#include <string>

namespace viwo {

/// "%.*g" for terminal tables; "-" for what is not finite.
inline std::string significant(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  return text.data();
}

}  // namespace viwo
