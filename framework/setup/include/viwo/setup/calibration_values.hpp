// What a filter has of a calibration.yaml.
#pragma once

#include <string_view>

#include "viwo/calibration_file/calibration_file.hpp"
#include "viwo/filter/filter.hpp"

namespace viwo {

struct RunSetup;

/// What a filter knows of the wheels and cameras of the configuration, with the covariance across
/// blocks. What wanders is not in it.
CalibrationFile calibration_file_of(const Filter& filter);
/// Adds what a run with that filter says of models and cameras.
void describe_rig(const RunSetup& setup, CalibrationFile& file);

/// Whether a block is of what the configuration says of cameras and wheel sets (viwo/api/rig.hpp).
bool is_of_the_rig(std::string_view block);

}  // namespace viwo
