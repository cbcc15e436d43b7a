// How the wheels of recordings wander about what is constant of them, from how they contradict
// each other now and later. Equations: docs/math/batch_calibration.md, CAL-6, CAL-7.
#pragma once

#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {

/// At calibration x_WI; of all recordings together.
WheelWander find_wander(const CalibrationSetup& setup, const Intrinsics& x_WI);

}  // namespace viwo::calibration
