// What `viwo calibrate` prints and writes.
#pragma once

#include <filesystem>
#include <string>

#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {

/// Writes calibration.yaml, summary.json and report.html.
void write_calibration(const std::filesystem::path& folder, const CalibrationResult& result);

/// Tables for the terminal.
std::string describe(const CalibrationResult& result);

}  // namespace viwo::calibration
