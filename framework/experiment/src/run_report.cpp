// The page of a run.
#include <algorithm>
#include <cmath>

#include "viwo/experiment/output.hpp"

namespace viwo::experiment {
namespace {

/// Estimate with its three-sigma band and the truth, thinned.
report::Plot calibration_plot(const RunResult& result, const CalibrationTrack& track) {
  report::Plot plot{track.name, "time [s]", track.name};
  plot.half_width = true;
  report::Series estimate, truth;
  estimate.name = "estimate, 3 sigma";
  truth.name = "truth";
  truth.reference = true;
  const std::size_t n = track.estimate.size();
  const std::size_t step = std::max<std::size_t>(1, n / 300);
  for (std::size_t i = 0; i < n; i += step) {
    estimate.x.push_back(result.epoch_t_s[i]);
    estimate.y.push_back(track.estimate[i]);
    estimate.y_low.push_back(track.estimate[i] - 3. * track.sigma[i]);
    estimate.y_high.push_back(track.estimate[i] + 3. * track.sigma[i]);
  }
  plot.series.push_back(estimate);
  if (std::isfinite(track.truth)) {
    truth.x = {result.epoch_t_s.front(), result.epoch_t_s.back()};
    truth.y = {track.truth, track.truth};
    plot.series.push_back(truth);
  }
  return plot;
}

/// What only the filter has: consistency, updates, calibration over time.
void add_filter_sections(const RunResult& result, report::Document& document) {
  using namespace report;
  Table updates;
  updates.caption = "Updates";
  updates.columns = {{"update"}, {"applied"}, {"rejected"}};
  for (const UpdateTrack& update : result.updates) {
    updates.rows.push_back({update.name, update.total.applied, update.total.rejected});
  }
  document.sections[0].blocks.emplace_back(updates);
  if (!result.nees.series.empty()) {
    Plot nees{"Normalised estimation error squared of the pose", "time [s]", "NEES"};
    nees.half_width = true;
    nees.lines = {{ReferenceLine::Direction::kHorizontal, 6., "consistent"}};
    Series series;
    series.name = "NEES";
    for (const auto& [t_s, value] : result.nees.series) {
      series.x.push_back(t_s);
      series.y.push_back(value);
    }
    nees.series.push_back(series);
    document.sections[1].blocks.emplace_back(nees);
  }
  Section calibration{"Calibration", {}};
  for (const CalibrationTrack& track : result.calibration) {
    const bool estimated = !track.sigma.empty() && track.sigma.front() > 0.;
    if (estimated) calibration.blocks.emplace_back(calibration_plot(result, track));
  }
  if (!calibration.blocks.empty()) document.sections.push_back(calibration);
}

}  // namespace

report::Document report_of(const RunSetup& setup, const RunResult& result) {
  using namespace report;
  const std::string model =
      setup.model ? setup.kinematics.info.name + " " + setup.kinematics.info.version : "no wheels";
  Document document{setup.name,
                    setup.filter ? "filter over vision, inertia and wheels (" + model + ")"
                                 : "wheel odometry with " + model,
                    {}};
  KeyValues facts;
  facts.entries = {{"status", std::string(name(result.status)) +
                                  (result.cause.empty() ? "" : ": " + result.cause)},
                   {"seed", static_cast<double>(setup.seed)},
                   {"duration [s]", result.duration_s},
                   {"epochs", result.epochs},
                   {"mean time of an epoch [ms]", result.total_ms.mean_ms}};
  if (!setup.filter) {
    const PreintegratedPose& total = result.total;
    facts.entries.push_back({"samples", total.samples});
    facts.entries.push_back({"samples not believed (parity gate)", total.gated});
    facts.entries.push_back({"rank-deficient samples", total.rank_deficient});
    facts.entries.push_back({"bridged [s]", total.bridged_s});
  }
  if (result.accuracy) {
    facts.entries.push_back({"path length [m]", result.accuracy->path_length_m});
    facts.entries.push_back({"end position error [mm]", 1e3 * result.accuracy->end_m});
    facts.entries.push_back({"end yaw error [deg]", result.accuracy->end_yaw_deg});
    facts.entries.push_back({"ATE [mm]", 1e3 * result.accuracy->ate_m});
    if (setup.filter) {
      facts.entries.push_back({"pose NEES (6 is consistent)", result.nees.pose});
    } else {
      facts.entries.push_back({"planar NEES (3 is consistent)", result.nees_planar});
    }
  }
  document.sections.push_back({"Result", {facts}});
  if (!result.rejections.empty()) {
    Table table;
    table.caption = "Not used";
    table.columns = {{"count"}, {"source"}, {"reason"}, {"first"}};
    for (const auto& [source, rejection] : result.rejections) {
      table.rows.push_back({rejection.count, source, rejection.reason, rejection.first});
    }
    document.sections.back().blocks.emplace_back(std::move(table));
  }
  Plot top{"Trajectory, seen from above", "x [m]", "y [m]"};
  top.equal_axes = true;
  top.half_width = true;
  top.series.push_back(trajectory_series("estimate", result.estimate));
  if (!result.reference.empty()) {
    top.series.push_back(trajectory_series("reference", result.reference));
    top.series.back().reference = true;
  }
  document.sections.push_back({"Trajectory", {top}});
  if (result.accuracy) {
    Plot error{"Position error", "path length [m]", "error [mm]"};
    error.half_width = true;
    error.series.push_back(error_series("estimate", *result.accuracy));
    document.sections.back().blocks.emplace_back(error);
  }
  if (setup.filter) add_filter_sections(result, document);
  document.sections.push_back(
      {"Configuration", {Paragraph{"The resolved configuration is in config.resolved.yaml."}}});
  return document;
}

}  // namespace viwo::experiment
