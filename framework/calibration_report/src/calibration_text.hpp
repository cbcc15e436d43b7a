// What terminal and page of a calibration both say.
#pragma once

#include <string>
#include <vector>

#include "viwo/calibration/calibrate.hpp"
#include "viwo/report/html.hpp"

namespace viwo::calibration {

/// Mean end errors of dead reckoning; NaN without a reference of positions.
struct EndErrors {
  double mm, yaw_rad;
};

/// Of a set of recordings, nominal and calibrated.
struct ErrorRow {
  std::string name;
  std::size_t runs = 0;
  EndErrors nominal, calibrated;
};

/// "all" and one row per value of each label in report_by; none where no recording has a reference.
std::vector<ErrorRow> error_rows(const CalibrationSetup& setup,
                                 const std::vector<ValidationRun>& runs);

const WheelModel& model_of(const CalibrationResult& result);

std::string left_out_title(const LeftOut& left_out);
/// One of those that could not be fitted.
std::string without_text(const LeftOut& left_out, const std::string& failed);
/// What wanders, and what to write into the configuration of a filter.
std::string wander_text(const WheelWander& wander);
/// What was searched and found of the joints; empty for nothing.
std::vector<std::string> search_text(const CalibrationResult& result);
/// What a smoother has estimated of mount, clocks and cameras.
CalibrationFile::Entries beside_the_wheels(const CalibrationResult& result);
/// What the fit cannot explain.
std::string left_over_text(const CalibrationResult& result);
/// Biases of the gyro over the recordings; empty where none were estimated.
std::string bias_text(const CalibrationResult& result);
/// Offsets of the clocks, likewise.
std::string clock_text(const CalibrationResult& result);
/// "ok", "doubtful" or, without an estimate, "failed".
std::string status_of(const CalibrationResult& result);

/// The page report.html.
report::Document page_of(const CalibrationResult& result);

}  // namespace viwo::calibration
