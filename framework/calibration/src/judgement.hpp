// Whether a calibration is to be trusted.
#pragma once

#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {

/// Fills in doubts and warnings.
void judge(CalibrationResult& result);

/// Likewise, of what the wheels say of themselves: drives that never turn, channels that the others
/// contradict, and by how much they all do.
void judge_wheels(CalibrationResult& result);

/// Sigmas by which one of so many estimates may differ, whose noise was found in as many residuals
/// as there are beyond the unknowns.
double most_by_chance(int spare_residuals, int estimates);

}  // namespace viwo::calibration
