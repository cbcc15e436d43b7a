// A document that uses everything a report can show.
#pragma once

#include "viwo/report/document.hpp"

namespace viwo::report {

inline constexpr int kSamplePlots = 7;

Document sample_document();

}  // namespace viwo::report
