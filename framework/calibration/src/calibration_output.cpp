// What a calibration leaves behind: calibration.yaml, summary.json, report.html, terminal tables.
#include <cmath>
#include <set>
#include <sstream>

#include "viwo/calibration/calibrate.hpp"
#include "viwo/eval/json.hpp"
#include "viwo/eval/statistics.hpp"
#include "viwo/log/files.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/report/curves.hpp"
#include "viwo/report/html.hpp"
#include "viwo/results/run_output.hpp"
#include "viwo/setup/calibration_file.hpp"

namespace viwo::calibration {
namespace {

using nlohmann::json;

struct Errors {
  double end_mm, end_yaw_rad;
};

Errors errors_of(const RunResult& run) {
  if (!run.accuracy) return {std::nan(""), std::nan("")};
  return {1e3 * run.accuracy->end_m, std::abs(run.accuracy->end_yaw_deg) * M_PI / 180.};
}

/// Mean errors of a set of recordings, nominal and calibrated.
struct ErrorRow {
  std::string name;
  std::size_t runs = 0;
  Errors nominal, calibrated;
};

/// "all" and one row per value of each label in report_by.
std::vector<ErrorRow> error_rows(const CalibrationSetup& setup,
                                 const std::vector<ValidationRun>& runs) {
  const auto mean_over = [&](const std::string& name, auto&& passes) {
    std::vector<double> values[4];
    for (const ValidationRun& run : runs) {
      if (!passes(setup.recordings[run.recording].label.labels)) continue;
      const Errors nominal = errors_of(run.nominal), calibrated = errors_of(run.calibrated);
      values[0].push_back(nominal.end_mm);
      values[1].push_back(nominal.end_yaw_rad);
      values[2].push_back(calibrated.end_mm);
      values[3].push_back(calibrated.end_yaw_rad);
    }
    return ErrorRow{name,
                    values[0].size(),
                    {eval::mean(values[0]), eval::mean(values[1])},
                    {eval::mean(values[2]), eval::mean(values[3])}};
  };
  std::vector<ErrorRow> rows{mean_over("all", [](const auto&) { return true; })};
  for (const std::string& label : setup.report_by) {
    std::set<std::string> seen;
    for (const auto& recording : setup.recordings) {
      const auto found = recording.label.labels.find(label);
      if (found == recording.label.labels.end() || !seen.insert(found->second).second) continue;
      rows.push_back(mean_over(found->second, [&](const auto& labels) {
        const auto at = labels.find(label);
        return at != labels.end() && at->second == found->second;
      }));
    }
  }
  return rows;
}

std::string direction_text(const UndeterminedDirection& direction) {
  std::string text;
  for (const auto& [name, weight] : direction.weights) {
    if (std::abs(weight) < 0.25 * std::abs(direction.weights.front().second)) break;
    if (!text.empty()) text += weight < 0. ? " - " : " + ";
    if (text.empty() && weight < 0.) text += "-";
    text += significant(std::abs(weight), 2) + " " + name;
  }
  return text;
}

/// Right-aligned in its column, apart from the one before however long it is.
std::string pad(const std::string& text, std::size_t width) {
  return std::string(std::max(width, text.size() + 1) - text.size(), ' ') + text;
}

std::string left_out_title(const LeftOut& left_out) {
  return "End error of dead reckoning, recordings left out of the fit by " + left_out.by;
}

void describe_errors(const std::string& title, const CalibrationSetup& setup,
                     const std::vector<ValidationRun>& runs, std::ostringstream& out) {
  if (runs.empty()) return;
  out << "\n"
      << title << "\n"
      << pad("", 16) << pad("runs", 6) << pad("nominal", 12) << pad("", 10) << pad("calibrated", 14)
      << "\n"
      << pad("", 22) << pad("[mm]", 12) << pad("[rad]", 10) << pad("[mm]", 14) << pad("[rad]", 10)
      << "\n";
  for (const ErrorRow& row : error_rows(setup, runs)) {
    out << row.name
        << pad(std::to_string(row.runs), 22 - std::min<std::size_t>(row.name.size(), 16))
        << pad(significant(row.nominal.end_mm, 4), 12)
        << pad(significant(row.nominal.end_yaw_rad, 3), 10)
        << pad(significant(row.calibrated.end_mm, 4), 14)
        << pad(significant(row.calibrated.end_yaw_rad, 3), 10) << "\n";
  }
}

json errors_json(const CalibrationSetup& setup, const std::vector<ValidationRun>& runs) {
  json out = json::object();
  for (const ErrorRow& row : error_rows(setup, runs)) {
    const auto entry = [](const Errors& errors) {
      return json{{"end_m", number_or_null(1e-3 * errors.end_mm)},
                  {"end_yaw_abs_rad", number_or_null(errors.end_yaw_rad)}};
    };
    out[row.name] = {
        {"runs", row.runs}, {"nominal", entry(row.nominal)}, {"calibrated", entry(row.calibrated)}};
  }
  return out;
}

report::Table error_table(const CalibrationSetup& setup, const std::vector<ValidationRun>& runs) {
  report::Table table;
  table.columns = {{"recordings"},          {"runs"},
                   {"nominal end [mm]"},    {"nominal yaw [rad]"},
                   {"calibrated end [mm]"}, {"calibrated yaw [rad]"}};
  for (const ErrorRow& row : error_rows(setup, runs)) {
    table.rows.push_back({row.name, static_cast<double>(row.runs), row.nominal.end_mm,
                          row.nominal.end_yaw_rad, row.calibrated.end_mm,
                          row.calibrated.end_yaw_rad});
  }
  return table;
}

const WheelModel& model_of(const CalibrationResult& result) {
  return *result.setup->recordings.front().setup.model;
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
                          (result.all.x_WI[k] - specs[i].nominal) / specs[i].prior_sigma});
  }
  return table;
}

/// What was found, and what to write.
std::string wander_text(const WheelWander& wander) {
  if (wander.lag_s.empty()) {
    return "whether the intrinsics wander cannot be told: only wheels that could contradict each "
           "other, for longer than a second, tell it";
  }
  if (!(wander.sigma > 0.)) return "the wheels contradict each other as noise does: none wanders";
  const std::string sigma = significant(wander.sigma, 2), time_s = significant(wander.time_s, 2);
  return "the intrinsics wander by " + sigma + " prior sigmas, for " + time_s +
         " s: wheels.intrinsics_wander=" + sigma + ", wheels.intrinsics_wander_time_s=" + time_s +
         " in a filter";
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
  const auto& runs = result.left_out.empty() ? result.fitted : result.left_out.front().runs;
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

std::string describe(const CalibrationResult& result) {
  std::ostringstream out;
  const CalibrationEstimate& estimate = result.all;
  out << pad("parameter", 12) << pad("unit", 6) << pad("nominal", 12) << pad("estimate", 12)
      << pad("sigma", 12) << pad("change/prior", 14) << "\n";
  const auto& specs = model_of(result).description().intrinsics;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    out << pad(specs[i].name, 12) << pad(specs[i].unit, 6)
        << pad(significant(specs[i].nominal, 6), 12) << pad(significant(estimate.x_WI[k], 6), 12)
        << pad(estimate.sigma[k] > 0. ? significant(estimate.sigma[k], 3) : "held", 12)
        << pad(significant((estimate.x_WI[k] - specs[i].nominal) / specs[i].prior_sigma, 3), 14)
        << "\n";
  }
  if (result.setup->options.estimate_extrinsics) {
    const char* names[] = {"x_OinB", "y_OinB", "yaw_OinB"};
    for (int i = 0; i < 3; ++i) {
      out << pad(names[i], 12) << pad(i < 2 ? "m" : "rad", 6) << pad("0", 12)
          << pad(significant(estimate.extrinsics[i], 6), 12)
          << pad(significant(estimate.extrinsics_sigma[i], 3), 12) << "\n";
    }
  }
  if (!result.left_out.empty()) {
    out << "sigma: that of the fit, or of how the estimate changes when ";
    for (std::size_t i = 0; i < result.left_out.size(); ++i) {
      out << (i > 0 ? " or " : "") << "a " << result.left_out[i].by;
    }
    out << " is left out, if that is larger\n";
  }
  out << "what the fit leaves per segment: " << significant(1e3 * estimate.noise.position_m, 3)
      << " mm, " << significant(estimate.noise.yaw_rad, 3) << " rad; parity residual "
      << significant(estimate.noise.parity_scale, 3) << " x the model's sigmas\n";
  out << wander_text(result.wander) << "\n";
  if (!estimate.clock_offset_s.empty() && result.setup->options.clock_offset_sigma_s > 0.) {
    out << "clock offsets of the recordings: mean "
        << significant(1e3 * eval::mean(estimate.clock_offset_s), 3) << " ms, spread "
        << significant(1e3 * eval::sample_standard_deviation(estimate.clock_offset_s), 3)
        << " ms\n";
  }
  if (estimate.undetermined.empty()) {
    out << "the data determine all directions better than the prior\n";
  } else {
    out << "directions that the data do not determine (in prior sigmas; posterior / prior):\n";
    for (const auto& direction : estimate.undetermined) {
      out << pad(significant(direction.sigma_ratio, 2), 8) << "  " << direction_text(direction)
          << "\n";
    }
  }
  describe_errors("End error of dead reckoning, recordings used in the fit", *result.setup,
                  result.fitted, out);
  for (const LeftOut& left_out : result.left_out) {
    describe_errors(left_out_title(left_out), *result.setup, left_out.runs, out);
  }
  return out.str();
}

void write_calibration(const std::filesystem::path& folder, const CalibrationResult& result) {
  log::make_folder(folder);
  const CalibrationEstimate& estimate = result.all;
  const RunSetup& setup = result.setup->recordings.front().setup;
  const CalibrationFile file{
      estimate.x_WI, estimate.sigma, estimate.extrinsics,
      setup.preintegration.twist.noise_weighted ? "noise_weighted" : "plain"};
  log::write_text(
      folder / "calibration.yaml",
      "# Written by viwo calibrate; include it with kinematics.calibration in a run.\n" +
          calibration_text(file, *setup.model, setup.kinematics.info.name));
  json parameters = json::object();
  const auto& specs = setup.model->description().intrinsics;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    parameters[specs[i].name] = {{"initial", specs[i].nominal},
                                 {"final", estimate.x_WI[k]},
                                 {"sigma", estimate.sigma[k]},
                                 {"sigma_of_fit", result.sigma_of_fit[k]},
                                 {"unit", specs[i].unit}};
  }
  json undetermined = json::array();
  for (const auto& direction : estimate.undetermined) {
    json weights = json::object();
    for (const auto& [name, weight] : direction.weights) weights[name] = weight;
    undetermined.push_back({{"sigma_ratio", direction.sigma_ratio}, {"weights", weights}});
  }
  std::vector<json> left_out;
  json by_label = json::object();
  for (const LeftOut& one : result.left_out) {
    left_out.push_back(errors_json(*result.setup, one.runs));
    by_label[one.by] = left_out.back();
  }
  const json summary = {
      {"status", estimate.converged ? "ok" : "failed"},
      {"calibration", parameters},
      {"noise",
       {{"position_m", estimate.noise.position_m},
        {"yaw_rad", estimate.noise.yaw_rad},
        {"parity_scale", estimate.noise.parity_scale}}},
      {"wander", {{"sigma", result.wander.sigma}, {"time_s", result.wander.time_s}}},
      {"clock_offset_s", estimate.clock_offset_s},
      {"undetermined", undetermined},
      {"fitted", errors_json(*result.setup, result.fitted)},
      {"left_out", left_out.empty() ? json::object() : left_out.front()},
      {"left_out_by", by_label}};
  log::write_text(folder / "summary.json", summary.dump(2) + "\n");

  report::Document document{result.setup->name,
                            "batch calibration of " + setup.kinematics.info.name + " from " +
                                std::to_string(result.setup->recordings.size()) + " recordings",
                            {}};
  document.sections.push_back({"Parameters", {parameter_table(result)}});
  for (const auto& direction : estimate.undetermined) {
    document.sections.back().blocks.emplace_back(report::Paragraph{
        "Not determined by the data (sigma is " + significant(direction.sigma_ratio, 2) +
            " of the prior's): " + direction_text(direction),
        report::Paragraph::Tone::kNote});
  }
  document.sections.push_back(
      {"End error, recordings used in the fit", {error_table(*result.setup, result.fitted)}});
  for (const LeftOut& one : result.left_out) {
    document.sections.push_back({left_out_title(one), {error_table(*result.setup, one.runs)}});
  }
  add_wander(result.wander, document);
  add_plots(result, document);
  log::write_text(folder / "report.html", report::to_html(document));
}

}  // namespace viwo::calibration
