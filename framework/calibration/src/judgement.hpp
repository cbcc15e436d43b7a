// Whether a calibration is to be trusted.
#pragma once

#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {

/// Fills in doubts and warnings.
void judge(CalibrationResult& result);

}  // namespace viwo::calibration
