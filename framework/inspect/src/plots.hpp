// Plots of a recording.
#pragma once

#include <vector>

#include "recording.hpp"
#include "viwo/report/document.hpp"

namespace viwo::inspect {

std::vector<report::Plot> plots_of(const Recording& recording);

}  // namespace viwo::inspect
