// Plots of a recording.
#pragma once

#include <vector>

#include "viwo/report/document.hpp"
#include "viwo/series/recording.hpp"

namespace viwo::inspect {

std::vector<report::Plot> plots_of(const series::Recording& recording);

}  // namespace viwo::inspect
