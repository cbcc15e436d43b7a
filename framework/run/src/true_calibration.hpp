// The true calibration of a run, and how far an estimate is from it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "viwo/run/run.hpp"

namespace viwo {

/// What is known by name: `given` by sensors, then where the configuration was made wrong. Wheel
/// sets of which all is known are brought into the gauge that the estimate holds.
std::map<std::string, double> true_calibration(const FilterSetup& setup,
                                               const std::map<std::string, double>& given);

/// Truth and final error, in the filter's own error convention, of each track whose truth is known;
/// tracks are in the order of the filter's blocks.
void compare_calibration(const std::map<std::string, double>& truth, const Filter& filter,
                         std::vector<CalibrationTrack>& tracks);

}  // namespace viwo
