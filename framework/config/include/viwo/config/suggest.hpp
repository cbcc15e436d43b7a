// "did you mean": the nearest valid spelling of a name.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace viwo::config {

/// The candidate with the smallest edit distance to `name` (insertions, deletions, substitutions,
/// swaps of neighbours), at most 2 and less than a complete replacement; empty if there is none.
/// Among equals the first.
std::string nearest(std::string_view name, std::span<const std::string> candidates);

/// " - did you mean 'x'?", or " - known: a, b, c" if nothing is near, or "" without candidates.
std::string did_you_mean(std::string_view name, std::span<const std::string> candidates);

}  // namespace viwo::config
