// "did you mean": the nearest valid spelling of a name.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace viwo::config {

/// Insertions, deletions, substitutions and swaps of neighbours that it takes (optimal string
/// alignment); a digit for another counts twice, and so does a letter that is a word of its own.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The candidate with the smallest edit distance to `name`, at most 2 and less than a complete
/// replacement; empty if there is none. Among equals the first.
std::string nearest(std::string_view name, std::span<const std::string> candidates);

/// " - did you mean 'x'?", or " - known: a, b, c" if nothing is near, or "" without candidates.
std::string did_you_mean(std::string_view name, std::span<const std::string> candidates);

}  // namespace viwo::config
