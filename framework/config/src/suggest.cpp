#include "viwo/config/suggest.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace viwo::config {
namespace {

constexpr std::size_t kFar = 3;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Digits number things: r_5 is no misspelling of r_1.
std::size_t change_cost(char a, char b) {
  if (a == b) return 0;
  return is_digit(a) && is_digit(b) ? 2 : 1;
}

/// Optimal string alignment distance.
std::size_t distance(std::string_view a, std::string_view b) {
  if (std::max(a.size(), b.size()) - std::min(a.size(), b.size()) >= kFar) return kFar;
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = change_cost(a[i - 1], b[j - 1]);
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + change});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
      }
    }
  }
  return d[a.size()][b.size()];
}

}  // namespace

std::string nearest(std::string_view name, std::span<const std::string> candidates) {
  std::string best;
  std::size_t best_distance = kFar;
  for (const std::string& candidate : candidates) {
    const std::size_t d = distance(name, candidate);
    // Two slips in a short word make another word, one slip in a single letter too.
    const std::size_t size = std::max(name.size(), candidate.size());
    if (d >= best_distance || (d == 1 ? size < 2 : 2 * d >= size)) continue;
    best = candidate;
    best_distance = d;
  }
  return best;
}

std::string did_you_mean(std::string_view name, std::span<const std::string> candidates) {
  if (candidates.empty()) return "";
  const std::string near = nearest(name, candidates);
  if (!near.empty()) return " - did you mean '" + near + "'?";
  std::string known;
  for (const std::string& candidate : candidates) known += (known.empty() ? "" : ", ") + candidate;
  return " - known: " + known;
}

}  // namespace viwo::config
