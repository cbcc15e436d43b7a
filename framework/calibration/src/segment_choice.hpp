// How long the segments are that wheels and reference are compared over.
#pragma once

#include <string>
#include <vector>

#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {

/// Longest time between two poses of most of a reference; infinite for none.
double pose_interval_s(const CalibrationSetup& setup);

/// The options of a fit, segments chosen: those of the configuration, or, of several lengths, that
/// with the smallest log_volume (CAL-11). `result` gets the estimates of all
/// lengths, and those that could not be fitted. Throws InputError when none could.
CalibrationOptions choose_segments(const CalibrationSetup& setup, const FitStart& start,
                                   CalibrationResult& result, WorkProgress& progress);

}  // namespace viwo::calibration
