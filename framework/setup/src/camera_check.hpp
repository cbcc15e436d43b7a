// Whether the cameras of the filter are those that its sensors know.
#pragma once

#include <string>
#include <vector>

#include "viwo/setup/run_setup.hpp"

namespace viwo {

/// A line for every sensor whose Kalibr file (sensors.NAME.cameras) says something else of a camera
/// than what the filter begins with (cameras.kalibr), with the first difference. A start that is
/// wrong on purpose is one, too: no error.
std::vector<std::string> compare_cameras(const RunSetup& setup);

}  // namespace viwo
