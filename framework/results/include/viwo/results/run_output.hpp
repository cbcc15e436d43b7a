// The files that a run leaves behind. A file that cannot be written completely is an error
// (std::runtime_error), never a silent loss.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "viwo/report/document.hpp"
#include "viwo/run/run_result.hpp"
#include "viwo/setup/run_setup.hpp"

namespace viwo {

/// "0.1.0"
const char* viwo_version();

/// summary.json of a run.
nlohmann::json summary_of(const RunSetup& setup, const RunResult& result);

/// report.html of a run, as a document.
report::Document report_of(const RunSetup& setup, const RunResult& result);

/// What a run leaves behind; of one in pieces there are their trajectories, too.
inline constexpr std::initializer_list<const char*> kResultsOfRun = {
    "config.resolved.yaml", "trajectory.tum", "reference.tum", "calibration.csv",
    "calibration.yaml",     "timing.csv",     "summary.json",  "report.html"};

/// Writes them.
void write_run(const std::filesystem::path& folder, const RunSetup& setup, const RunResult& result);

/// A few lines for the terminal.
std::string describe(const RunResult& result);

/// "0.97", or "at most 0.1" where the residuals are so small that what is common to many of them
/// (floors, the calibration) hides the noise: no figure for it.
std::string found_text(const NoiseFound& noise);

/// "sensor: 3 x reason, first at odom_1.csv.gz:17" for everything that was dropped.
std::vector<std::string> describe_rejections(const RunResult& result);

/// "wheels failed in 10 epochs and was disabled: cause" for every update that threw.
std::vector<std::string> describe_failures(const RunResult& result);

}  // namespace viwo
