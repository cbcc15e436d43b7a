// Times as texts.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>

namespace viwo {

/// "t = 12.345 s", of a stamp or of the time since something.
inline std::string time_text(std::int64_t t_ns) {
  char text[48];
  std::snprintf(text, sizeof text, "t = %.3f s", 1e-9 * static_cast<double>(t_ns));
  return text;
}

}  // namespace viwo
