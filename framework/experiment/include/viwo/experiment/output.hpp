// Files that commands leave behind. A file that cannot be written completely is an error
// (std::runtime_error), never a silent loss.
#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "viwo/experiment/run.hpp"
#include "viwo/report/document.hpp"

namespace viwo::experiment {

void make_folder(const std::filesystem::path& folder);
void write_text(const std::filesystem::path& file, const std::string& text);

/// NaN and infinity, which JSON does not have, become null.
nlohmann::json number_or_null(double value);

/// "%.*g" for terminal tables; "-" for what is not finite.
std::string significant(double value, int digits);

/// summary.json of a run.
nlohmann::json summary_of(const RunSetup& setup, const RunResult& result);

/// report.html of a run, as a document.
report::Document report_of(const RunSetup& setup, const RunResult& result);

/// Writes config.resolved.yaml, trajectory.tum, reference.tum, calibration.csv, timing.csv,
/// summary.json and report.html.
void write_run(const std::filesystem::path& folder, const RunSetup& setup, const RunResult& result);

/// A few lines for the terminal.
std::string describe(const RunResult& result);

/// "sensor: 3 x reason, first at odom_1.csv.gz:17" for everything that was dropped.
std::vector<std::string> describe_rejections(const RunResult& result);

/// Trajectory as a curve of a plot, thinned to at most `max_points`.
report::Series trajectory_series(const std::string& name, const Trajectory& trajectory,
                                 std::size_t max_points = 600);

/// Position error over the reference's path length as a curve, thinned likewise.
report::Series error_series(const std::string& name, const eval::Accuracy& accuracy,
                            std::size_t max_points = 600);

}  // namespace viwo::experiment
