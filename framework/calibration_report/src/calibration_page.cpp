// The page of a calibration.
#include <cmath>

#include "calibration_text.hpp"
#include "viwo/math/combination_text.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/report/curves.hpp"

namespace viwo::calibration {
namespace {

constexpr auto kNote = report::Paragraph::Tone::kNote;

report::Table error_table(const CalibrationSetup& setup, const std::vector<ValidationRun>& runs) {
  report::Table table;
  table.columns = {{"recordings"},          {"runs"},
                   {"nominal end [mm]"},    {"nominal yaw [rad]"},
                   {"calibrated end [mm]"}, {"calibrated yaw [rad]"}};
  for (const ErrorRow& row : error_rows(setup, runs)) {
    table.rows.push_back({row.name, static_cast<double>(row.runs), row.nominal.mm,
                          row.nominal.yaw_rad, row.calibrated.mm, row.calibrated.yaw_rad});
  }
  return table;
}

report::Table parameter_table(const CalibrationResult& result) {
  report::Table table;
  table.columns = {{"parameter"},
                   {"unit"},
                   {"nominal", {report::NumberFormat::Style::kSignificant, 6}},
                   {"estimate", {report::NumberFormat::Style::kSignificant, 6}},
                   {"sigma", {report::NumberFormat::Style::kSignificant, 3}},
                   {"of the fit", {report::NumberFormat::Style::kSignificant, 3}},
                   {"change / prior sigma", {report::NumberFormat::Style::kFixed, 2}}};
  const auto& specs = model_of(result).description().intrinsics;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    table.rows.push_back({specs[i].name, specs[i].unit, specs[i].nominal, result.all.x_WI[k],
                          result.all.sigma[k], result.sigma_of_fit[k],
                          result.all.change(k, specs[i].nominal)});
  }
  for (const CalibrationEntry& entry : beside_the_wheels(result)) {
    table.rows.push_back(
        {entry.name, entry.unit, entry.nominal, entry.estimate, entry.sigma, entry.sigma, ""});
  }
  return table;
}

/// What other segments would have given.
report::Table length_table(const CalibrationResult& result) {
  report::Table table;
  table.columns = {{"segments"},
                   {"residuals"},
                   {"position [mm]"},
                   {"yaw [rad]", {report::NumberFormat::Style::kSignificant, 3}},
                   {"left-out ends [mm]", {report::NumberFormat::Style::kSignificant, 3}},
                   {"log volume", {report::NumberFormat::Style::kFixed, 1}}};
  for (const CalibrationEstimate& estimate : result.lengths) {
    const CalibrationNoise& noise = estimate.noise;
    const double nan = std::nan("");
    table.rows.push_back({segments_text(estimate), static_cast<double>(estimate.residuals),
                          noise.position_is_found ? 1e3 * noise.position_m : nan,
                          noise.yaw_is_found ? noise.yaw_rad : nan,
                          1e3 * estimate.prediction_m.value_or(nan), estimate.log_volume});
  }
  return table;
}

void add_wander(const WheelWander& wander, report::Document& document) {
  report::Plot plot{"How the intrinsics wander", "time between [s]", "covariance [prior sigmas^2]"};
  plot.caption =
      "How the wheels contradict each other now and later, as if all intrinsics wandered alike in "
      "units of their prior sigmas (CAL-6). White noise is zero, what is wrong for good a "
      "constant.";
  report::Series found{"found", wander.lag_s, wander.covariance};
  found.draw = report::Draw::kMarkers;
  plot.series.push_back(std::move(found));
  if (wander.sigma > 0.) {
    report::Series process{"Gauss-Markov", wander.lag_s, {}};
    for (const double lag_s : wander.lag_s) {
      process.y.push_back(wander.sigma * wander.sigma * std::exp(-lag_s / wander.time_s));
    }
    plot.series.push_back(std::move(process));
  }
  document.sections.push_back({"What is not constant", {report::Paragraph{wander_text(wander)}}});
  if (!wander.lag_s.empty()) document.sections.back().blocks.emplace_back(std::move(plot));
}

void add_plots(const CalibrationResult& result, report::Document& document) {
  const bool has_all = !result.left_out.empty() && result.left_out.front().failed.empty();
  const auto& runs = has_all ? result.left_out.front().runs : result.fitted;
  for (const ValidationRun& run : runs) {
    const CalibrationRecording& recording = result.setup->recordings[run.recording];
    std::string heading = "Recording " + recording.label.name;
    for (const std::string& label : result.setup->report_by) {
      const auto found = recording.label.labels.find(label);
      if (found != recording.label.labels.end()) heading += ", " + found->second;
    }
    report::Plot top{"Seen from above", "x [m]", "y [m]"};
    top.equal_axes = top.half_width = true;
    top.series = {report::trajectory_series("truth", run.nominal.reference, 300),
                  report::trajectory_series("nominal", run.nominal.estimate, 300),
                  report::trajectory_series("calibrated", run.calibrated.estimate, 300)};
    top.series[0].reference = true;
    report::Plot error{"Position error over path length", "path length [m]", "error [mm]"};
    error.half_width = true;
    if (run.nominal.accuracy && run.calibrated.accuracy) {
      error.series = {report::error_series("nominal", *run.nominal.accuracy, 300),
                      report::error_series("calibrated", *run.calibrated.accuracy, 300)};
    }
    document.sections.push_back({heading, {top, error}});
  }
}

}  // namespace

report::Document page_of(const CalibrationResult& result) {
  const RunSetup& setup = result.setup->recordings.front().setup;
  const CalibrationEstimate& estimate = result.all;
  report::Document document{result.setup->name,
                            "batch calibration of " + setup.kinematics.info.name + " from " +
                                std::to_string(result.setup->recordings.size()) + " recordings",
                            {}};
  document.sections.push_back({"Parameters", {parameter_table(result)}});
  auto& first = document.sections.back().blocks;
  for (const std::string& doubt : result.doubts) {
    first.emplace_back(report::Paragraph{"Not to be trusted: " + doubt, kNote});
  }
  for (const std::string& warning : result.warnings) {
    first.emplace_back(report::Paragraph{"Warning: " + warning, kNote});
  }
  for (const std::string& text : search_text(result)) first.emplace_back(report::Paragraph{text});
  first.emplace_back(report::Paragraph{left_over_text(result)});
  if (const std::string text = clock_text(result); !text.empty()) {
    first.emplace_back(report::Paragraph{text});
  }
  for (const auto& direction : estimate.undetermined) {
    document.sections.back().blocks.emplace_back(report::Paragraph{
        "Not determined by the data (sigma is " + significant(direction.sigma_ratio, 2) +
            " of the prior's): " + combination_text(direction.weights),
        kNote});
  }
  if (!result.lengths.empty()) {
    document.sections.push_back({"Lengths of segments", {length_table(result)}});
  }
  if (!error_rows(*result.setup, result.fitted).empty()) {
    document.sections.push_back(
        {"End error, recordings used in the fit", {error_table(*result.setup, result.fitted)}});
  }
  for (const LeftOut& one : result.left_out) {
    document.sections.push_back({left_out_title(one), {error_table(*result.setup, one.runs)}});
    for (const std::string& failed : one.failed) {
      document.sections.back().blocks.emplace_back(
          report::Paragraph{without_text(one, failed), kNote});
    }
  }
  add_wander(result.wander, document);
  add_plots(result, document);
  return document;
}

}  // namespace viwo::calibration
