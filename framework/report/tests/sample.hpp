// A document that uses everything a report can show.
#pragma once

#include <limits>
#include <string>

#include "viwo/report/document.hpp"

namespace viwo::report {

inline constexpr int kSamplePlots = 7;
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Document sample_document();

/// How often a part is in a text.
inline int count(const std::string& text, const std::string& part) {
  int n = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

}  // namespace viwo::report
