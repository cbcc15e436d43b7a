// Files that commands leave behind. A file that cannot be written completely is an error
// (std::runtime_error), never a silent loss.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "viwo/experiment/run.hpp"
#include "viwo/report/document.hpp"

namespace viwo::experiment {

void make_folder(const std::filesystem::path& folder);

/// All of it or nothing new is there under the name, also after a loss of power: FILE.tmp is on the
/// disk before it takes the name. std::runtime_error with the reason.
void write_text(const std::filesystem::path& file, const std::string& text);

/// "0.1.0"
const char* viwo_version();

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

/// "wheels failed in 10 epochs and was disabled: cause" for every update that threw.
std::vector<std::string> describe_failures(const RunResult& result);

/// Points of a curve that a page shows without getting slow.
inline constexpr std::size_t kMaxCurvePoints = 1200;

/// How values of an SI unit are shown: value * scale, in `name`.
struct DisplayUnit {
  std::string name;
  double scale = 1.;
};

/// mm, mrad, ms and their like where values as large as `magnitude`, in `si_unit`, read better in
/// them; `si_unit` itself otherwise, and for units without such a prefix.
DisplayUnit display_unit(const std::string& si_unit, double magnitude);

/// "heading [unit]"; the heading alone without a unit.
std::string with_unit(const std::string& heading, const std::string& unit);

/// Half the width of the bands of a page.
inline constexpr double kBandSigmas = 3.;

/// What a curve is made of; all spans of one size.
struct CurveData {
  std::span<const double> x;
  std::span<const double> y;
  std::span<const double> sigma = {};  ///< empty: no band
  double scale = 1.;                   ///< of y and sigma
};

/// y over x as a curve, with a three-sigma band around it if there are sigmas; thinned.
report::Series curve(const std::string& name, const CurveData& data,
                     std::size_t max_points = kMaxCurvePoints);

/// An error over x as a curve, with the band from minus to plus three sigma around zero; thinned.
report::Series error_curve(const std::string& name, const CurveData& data,
                           std::size_t max_points = kMaxCurvePoints);

/// The truth, which does not change, as a dashed line over a curve's x from `begin` to `end`.
report::Series truth_line(double begin, double end, double truth);

/// Trajectory as a curve of a plot, thinned to at most `max_points`.
report::Series trajectory_series(const std::string& name, const Trajectory& trajectory,
                                 std::size_t max_points = 600);

/// Position error over the reference's path length as a curve, thinned likewise.
report::Series error_series(const std::string& name, const eval::Accuracy& accuracy,
                            std::size_t max_points = 600);

}  // namespace viwo::experiment
