// Poses that no body can have gone through.
#pragma once

#include <string>

#include "viwo/checks/finding.hpp"
#include "viwo/series/recording.hpp"

namespace viwo::inspect {

/// Positions between which nothing can go: of a source that loses its place, or has none and says
/// zero.
bool has_jumps(const series::Poses& poses, const std::string& label, Findings& out);

/// Orientations between which nothing can turn: of markers that are taken for each other.
bool has_flips(const series::Poses& poses, const std::string& label, Findings& out);

}  // namespace viwo::inspect
