// What `viwo calibrate` prints and writes.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>

#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {

/// What a calibration leaves behind.
inline constexpr std::initializer_list<const char*> kResults = {"summary.json", "report.html",
                                                                "calibration.yaml"};

/// Writes them.
void write_calibration(const std::filesystem::path& folder, const CalibrationResult& result);

/// Tables for the terminal.
std::string describe(const CalibrationResult& result);

}  // namespace viwo::calibration
