// A calibration by all that the filter of the base takes.
#pragma once

#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {

/// The recordings named by index, smoothed. Throws InputError where they cannot be.
smoother::Smoothed smooth(const CalibrationSetup& setup, const std::vector<std::size_t>& recordings,
                          WorkProgress& progress);

/// What it says of the wheels of `kinematics`. InputError when the base does not estimate any.
CalibrationEstimate estimate_of(const smoother::Smoothed& smoothed, const CalibrationSetup& setup);

}  // namespace viwo::calibration
