// The page of a run: what ran, how accurate it was, and with which configuration.
#include "run_report.hpp"

#include <cmath>

#include "viwo/config/yaml.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/report/curves.hpp"
#include "viwo/results/metrics.hpp"
#include "viwo/results/run_output.hpp"

namespace viwo {
namespace {

using namespace report;

/// Height of the top view, and of what stands beside it.
constexpr int kTopViewHeight = 460;

KeyValues facts_of(const RunSetup& setup, const RunResult& result) {
  KeyValues facts;
  facts.entries = {{"status", status_text(result)},
                   {"seed", static_cast<double>(setup.seed)},
                   {"duration [s]", result.duration_s},
                   {"epochs", result.epochs}};
  if (result.wall_s > 0.) {
    facts.entries.push_back(
        {"real-time factor", significant(result.duration_s / result.wall_s, 3)});
  }
  facts.entries.push_back({"epoch, mean [ms]", significant(result.total_ms.mean_ms, 3)});
  if (result.accuracy) facts.entries.push_back({"path length [m]", result.accuracy->path_length_m});
  if (setup.filter) return facts;
  const PreintegratedPose& total = result.total;
  facts.entries.push_back({"encoder samples", total.samples});
  facts.entries.push_back({"not believed (parity gate)", total.gated});
  facts.entries.push_back({"rejected by the model", total.rejected});
  facts.entries.push_back({"rank-deficient", total.rank_deficient});
  facts.entries.push_back({"bridged [s]", total.bridged_s});
  return facts;
}

std::string alignment_text(eval::Alignment alignment) {
  switch (alignment) {
    case eval::Alignment::kNone:
      return "not aligned";
    case eval::Alignment::kStart:
      return "aligned at the start";
    case eval::Alignment::kYawPosition:
      return "aligned in yaw and position";
    case eval::Alignment::kSe3:
      return "aligned in six degrees of freedom";
  }
  return {};
}

Table accuracy_table(const eval::Accuracy& accuracy) {
  Table table;
  table.caption = "Accuracy against the reference";
  table.columns = {{"error"}, {"position [mm]"}, {"orientation [deg]"}, {"over"}};
  table.rows.push_back({"ATE: rms, " + alignment_text(accuracy.alignment), 1e3 * accuracy.ate_m,
                        accuracy.ate_deg, std::to_string(accuracy.n_poses) + " poses"});
  for (const eval::SegmentErrors& segment : accuracy.rpe) {
    if (segment.count == 0) continue;
    table.rows.push_back({"RPE over " + significant(segment.length_m, 4) + " m: mean",
                          1e3 * segment.mean_m, segment.mean_deg,
                          std::to_string(segment.count) + " segments"});
  }
  const bool is_aligned = accuracy.alignment != eval::Alignment::kNone;
  table.rows.push_back({is_aligned ? "at the end, aligned at the start" : "at the end",
                        1e3 * accuracy.end_m, accuracy.end_deg,
                        significant(accuracy.path_length_m, 4) + " m"});
  return table;
}

/// Whatever is declared in metrics.cpp and this run has.
Table metrics_table(const RunResult& result) {
  Table table;
  table.caption = "Numbers of this run, as tables of experiments have them";
  std::vector<Cell> row;
  for (const Metric& metric : metrics_over(segment_lengths_m(result))) {
    const double value = metric.of(result);
    if (!std::isfinite(value)) continue;
    table.columns.push_back({metric.heading});
    row.emplace_back(metric.table_scale * value);
  }
  table.rows.push_back(std::move(row));
  return table;
}

/// A run that was started anew.
Table pieces_table(const RunResult& result) {
  Table table;
  table.caption = "Pieces: after each failure but the last the filter began anew";
  table.columns = {{"piece"}, {"begins at [s]"}, {"length [s]"}, {"epochs"}, {"ended by"}};
  const std::int64_t begin_ns = result.pieces.front().begin_ns;
  for (std::size_t k = 0; k < result.pieces.size(); ++k) {
    const RunPiece& piece = result.pieces[k];
    table.rows.push_back({std::to_string(k + 1), seconds_between(begin_ns, piece.begin_ns),
                          seconds_between(piece.begin_ns, piece.end_ns), piece.epochs,
                          piece.failure.empty() ? "the end of the run" : piece.failure});
  }
  return table;
}

void add_result_section(const RunSetup& setup, const RunResult& result, Document& document) {
  Section section{"Result", {}};
  if (result.status != RunStatus::kOk) {
    section.blocks.emplace_back(Paragraph{std::string(name(result.status)) + ": " + result.cause,
                                          Paragraph::Tone::kWarning});
  }
  for (const std::string& line : result.doubts) {
    section.blocks.emplace_back(Paragraph{"Doubtful: " + line, Paragraph::Tone::kWarning});
  }
  for (const std::string& line : result.warnings) {
    section.blocks.emplace_back(Paragraph{line, Paragraph::Tone::kWarning});
  }
  section.blocks.emplace_back(facts_of(setup, result));
  if (Table metrics = metrics_table(result); !metrics.columns.empty()) {
    section.blocks.emplace_back(std::move(metrics));
  }
  if (result.pieces.size() > 1) section.blocks.emplace_back(pieces_table(result));
  if (result.accuracy) {
    section.blocks.emplace_back(accuracy_table(*result.accuracy));
  } else if (result.reference.empty()) {
    section.blocks.emplace_back(Paragraph{
        "There is no reference: nothing to compare the estimate with.", Paragraph::Tone::kNote});
  }
  document.sections.push_back(std::move(section));
}

void add_trajectory_section(const RunResult& result, Document& document) {
  if (result.estimate.empty()) return;
  Section section{"Trajectory", {}};
  Plot top{"Seen from above", "x [m]", "y [m]"};
  top.equal_axes = true;
  top.height_px = kTopViewHeight;
  const eval::Alignment alignment =
      result.accuracy ? result.accuracy->alignment : eval::Alignment::kNone;
  top.series.push_back(report::trajectory_series(
      "estimate", eval::aligned(result.reference, result.estimate, alignment),
      report::kMaxCurvePoints));
  top.series.back().colour = kEstimateColour;
  if (alignment != eval::Alignment::kNone) top.caption = "The estimate is aligned with the truth.";
  if (!result.reference.empty()) {
    top.series.push_back(
        report::trajectory_series("truth", result.reference, report::kMaxCurvePoints));
    top.series.back().reference = true;
  }
  if (!result.accuracy) {
    section.blocks.emplace_back(std::move(top));
    document.sections.push_back(std::move(section));
    return;
  }
  top.half_width = true;
  const eval::ErrorSeries& series = result.accuracy->series;
  Plot position{"Position error over the way", "path length [m]", "error [mm]"};
  position.half_width = true;
  position.height_px = kTopViewHeight;
  position.series.push_back(
      report::error_series("error", *result.accuracy, report::kMaxCurvePoints));
  position.series.back().colour = kEstimateColour;
  position.caption = result.accuracy->alignment == eval::Alignment::kNone
                         ? "Distance to the truth, without aligning the two."
                         : "Distance to the truth after aligning the first poses.";
  section.blocks.emplace_back(std::move(top));
  section.blocks.emplace_back(std::move(position));
  if (result.errors.empty()) {  // else the yaw is shown with its band
    Plot yaw{"Yaw error", "time [s]", "error [deg]"};
    yaw.series.push_back(report::curve("error", {series.t_s, series.yaw_error_deg}));
    yaw.series.back().colour = kEstimateColour;
    yaw.height_px = 300;
    section.blocks.emplace_back(std::move(yaw));
  }
  document.sections.push_back(std::move(section));
}

void add_configuration_section(const RunSetup& setup, Document& document) {
  Table plugins;
  plugins.caption = "Plugins of this run, with viwo " + std::string(viwo_version());
  plugins.columns = {{"used as"}, {"plugin"}, {"version"}, {"what it is"}};
  const auto add = [&](const std::string& use, const PluginInfo& info) {
    plugins.rows.push_back({use, info.name, info.version, info.summary});
  };
  if (setup.kinematics.object) add("kinematics", setup.kinematics.info);
  for (const SensorEntry& entry : setup.sensors) add("sensor " + entry.name, entry.sensor.info);
  if (setup.filter) {
    for (const FilterSetup::Entry& entry : setup.filter->updates) {
      add("update " + entry.name, entry.update.info);
    }
  }
  document.sections.push_back(
      {"Configuration",
       {std::move(plugins), Details{"The resolved configuration, a valid run configuration",
                                    config::to_yaml(setup.resolved)}}});
}

}  // namespace

void add_picture_section(const RunResult& result, Document& document) {
  if (result.pictures.empty()) return;
  Section section{"Pictures", {}};
  section.blocks.emplace_back(Paragraph{
      "The points that the filter was given, coloured by how long they had been tracked, with the "
      "way they came over the last images; a ring marks those in two cameras. Beside them the "
      "trajectory from above, below the calibration with bands of three sigma: around zero where "
      "the truth is known, else around the change since the start."});
  for (const RunPicture& picture : result.pictures) {
    const std::string at = significant(picture.t_s, 4) + " s";
    section.blocks.emplace_back(report::Image{
        at, "Tracked points, trajectory and calibration at " + at, "image/png", picture.png});
  }
  document.sections.push_back(std::move(section));
}

Document report_of(const RunSetup& setup, const RunResult& result) {
  const std::string model =
      setup.model ? setup.kinematics.info.name + " " + setup.kinematics.info.version : "no wheels";
  Document document{setup.name,
                    (setup.filter ? "filter over vision, inertia and wheels (" + model + ")"
                                  : "wheel odometry with " + model) +
                        ", viwo " + viwo_version(),
                    {}};
  add_result_section(setup, result, document);
  add_trajectory_section(result, document);
  add_picture_section(result, document);
  add_error_section(result, document);
  add_calibration_section(result, document);
  add_noise_section(result, document);
  add_excitation_section(result, document);
  add_measurements_section(result, document);
  add_time_section(result, document);
  add_configuration_section(setup, document);
  return document;
}

}  // namespace viwo
