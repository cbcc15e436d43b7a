// A direction in words: "0.54 y_3 - 0.51 y_4".
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>

#include "viwo/math/significant.hpp"

namespace viwo {

/// Names with their weights, in the order that is given, without those that weigh less than a
/// quarter of the largest.
inline std::string combination_text(std::span<const std::pair<std::string, double>> weights) {
  double most = 0.;
  for (const auto& [name, weight] : weights) most = std::max(most, std::abs(weight));
  std::string text;
  for (const auto& [name, weight] : weights) {
    if (std::abs(weight) < 0.25 * most) continue;
    if (!text.empty()) {
      text += weight < 0. ? " - " : " + ";
    } else if (weight < 0.) {
      text += "-";
    }
    text += significant(std::abs(weight), 2) + " " + name;
  }
  return text;
}

}  // namespace viwo
