// What the tracks of a run say of its calibration.
#pragma once

#include <vector>

#include "viwo/run/run_result.hpp"
#include "viwo/setup/calibration_file.hpp"

namespace viwo {

/// Not held at its prior from one end of the run to the other.
bool is_estimated(const CalibrationTrack& track);

/// Sigmas times what the parameter of that name scatters by (CalibrationTrack::scatter): such as
/// can be believed.
void widen(CalibrationFile& file, const std::vector<CalibrationTrack>& tracks);

}  // namespace viwo
