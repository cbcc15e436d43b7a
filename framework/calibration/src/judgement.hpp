// Whether a calibration is to be trusted.
#pragma once

#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {

/// Fills in doubts and warnings.
void judge(CalibrationResult& result);

/// Sigmas by which one of so many estimates may differ, whose noise was found in as many residuals
/// as there are beyond the unknowns.
double most_by_chance(int spare_residuals, int estimates);

}  // namespace viwo::calibration
