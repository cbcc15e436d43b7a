// What the tracks of a run say of its calibration.
#pragma once

#include <vector>

#include "viwo/calibration_file/calibration_file.hpp"
#include "viwo/run/run_result.hpp"

namespace viwo {

/// Whether a filter estimated this parameter: not held from one end of the run to the other, nor
/// of wheels alone.
bool is_estimated(const RunResult& run, const CalibrationTrack& track);

/// Sigmas times what the parameter of that name scatters by (CalibrationTrack::scatter): such as
/// can be believed.
void widen(CalibrationFile& file, const std::vector<CalibrationTrack>& tracks);

}  // namespace viwo
