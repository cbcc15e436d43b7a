// calibration.yaml: what `viwo calibrate` writes and a run configuration includes.
#pragma once

#include <filesystem>
#include <string>

#include "viwo/setup/run_setup.hpp"

namespace viwo {

struct CalibrationFile {
  Intrinsics x_WI;
  Intrinsics sigma;  ///< 0 where the gauge holds an entry
  PlanarExtrinsics extrinsics = PlanarExtrinsics::Zero();
  std::string twist;  ///< odometry.twist of the fit: the estimates belong to it
};

/// Throws InputError when the file is for another model or does not name all of its intrinsics.
CalibrationFile read_calibration(const std::filesystem::path& file, const WheelModel& model,
                                 const std::string& model_name);

/// YAML text with units and nominal values beside the estimates.
std::string calibration_text(const CalibrationFile& calibration, const WheelModel& model,
                             const std::string& model_name);

}  // namespace viwo
