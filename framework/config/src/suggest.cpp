#include "viwo/config/suggest.hpp"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace viwo::config {
namespace {

constexpr std::size_t kFar = 3;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

bool is_alphanumeric(char c) {
  return is_digit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// Whether the character at `i` is a word of its own.
bool is_alone(std::string_view text, std::size_t i) {
  return (i == 0 || !is_alphanumeric(text[i - 1])) &&
         (i + 1 == text.size() || !is_alphanumeric(text[i + 1]));
}

/// Digits number things, and letters that are alone name axes: r_5 is no misspelling of r_1, nor
/// a_z of a_x.
std::size_t change_cost(std::string_view a, std::size_t i, std::string_view b, std::size_t j) {
  if (a[i] == b[j]) return 0;
  if (is_digit(a[i]) && is_digit(b[j])) return 2;
  if (lower(a[i]) == lower(b[j])) return 1;
  return a.size() > 1 && b.size() > 1 && is_alone(a, i) && is_alone(b, j) ? 2 : 1;
}

}  // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = change_cost(a, i - 1, b, j - 1);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + change});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

std::string nearest(std::string_view name, std::span<const std::string> candidates) {
  std::string best;
  std::size_t best_distance = kFar;
  for (const std::string& candidate : candidates) {
    const std::size_t longer = std::max(name.size(), candidate.size());
    if (longer - std::min(name.size(), candidate.size()) >= kFar) continue;
    const std::size_t d = edit_distance(name, candidate);
    // Two slips in a short word make another word, one slip in a single letter too.
    if (d >= best_distance || (d == 1 ? longer < 2 : 2 * d >= longer)) continue;
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
