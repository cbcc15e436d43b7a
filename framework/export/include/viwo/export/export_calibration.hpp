// A calibration.yaml as other programs take it.
#pragma once

#include <string>
#include <vector>

#include "viwo/calibration_file/calibration_file.hpp"

namespace viwo::exports {

struct Exported {
  std::string text;               ///< the file; what is lost stands at its head
  std::vector<std::string> lost;  ///< what the calibration has and the format cannot hold
};

/// "urdf", "ros2_control", ...
std::vector<std::string> formats();

/// InputError for a format that there is not, and for a robot that it cannot hold, with the formats
/// that can. Which kind of base it is follows from the names of its intrinsics.
Exported export_calibration(const CalibrationFile& calibration, const std::string& format);

}  // namespace viwo::exports
