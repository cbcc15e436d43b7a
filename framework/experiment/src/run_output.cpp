// What a run leaves behind: tables, trajectories, summary.json, report.html.
#include <cmath>
#include <sstream>

#include <sys/resource.h>

#include "viwo/config/yaml.hpp"
#include "viwo/experiment/output.hpp"
#include "viwo/log/tum.hpp"
#include "viwo/report/html.hpp"

namespace viwo::experiment {
namespace {

double peak_rss_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.;
}

nlohmann::json stage_json(const StageTime& stage) {
  return {{"mean", stage.mean_ms}, {"p95", stage.p95_ms}, {"max", stage.max_ms}};
}

std::string calibration_csv(const RunSetup& setup, const RunResult& result) {
  std::ostringstream csv;
  csv.precision(17);
  csv << "time_s,name,estimate,sigma,truth\n";
  // Nothing is estimated while running here: one row per intrinsic, at the start and at the end.
  for (const double t_s : {0., result.duration_s}) {
    for (int i = 0; i < setup.model->n_intrinsics(); ++i) {
      csv << t_s << ',' << setup.model->description().intrinsics[static_cast<std::size_t>(i)].name
          << ',' << setup.x_WI[i] << ',' << setup.sigma[i] << ",\n";
    }
  }
  return csv.str();
}

std::string timing_csv(const RunResult& result) {
  std::ostringstream csv;
  csv << "time_s,preintegration_ms\n";
  for (const auto& [t_s, ms] : result.epoch_ms) csv << t_s << ',' << ms << '\n';
  return csv.str();
}

report::Document document_of(const RunSetup& setup, const RunResult& result) {
  using namespace report;
  Document document{
      setup.name,
      "wheel odometry with " + setup.kinematics.info.name + " " + setup.kinematics.info.version,
      {}};
  KeyValues facts;
  facts.entries = {{"status", std::string(name(result.status)) +
                                  (result.cause.empty() ? "" : ": " + result.cause)},
                   {"seed", static_cast<double>(setup.seed)},
                   {"duration [s]", result.duration_s},
                   {"samples", static_cast<double>(result.total.samples)},
                   {"samples not believed (parity gate)", static_cast<double>(result.total.gated)},
                   {"rank-deficient samples", static_cast<double>(result.total.rank_deficient)},
                   {"bridged [s]", result.total.bridged_s}};
  if (result.accuracy) {
    facts.entries.push_back({"path length [m]", result.accuracy->path_length_m});
    facts.entries.push_back({"end position error [mm]", 1e3 * result.accuracy->end_m});
    facts.entries.push_back({"end yaw error [deg]", result.accuracy->end_yaw_deg});
    facts.entries.push_back({"ATE [mm]", 1e3 * result.accuracy->ate_m});
    facts.entries.push_back({"planar NEES (3 is consistent)", result.nees_planar});
  }
  document.sections.push_back({"Result", {facts}});
  for (const std::string& line : describe_rejections(result)) {
    document.sections.back().blocks.emplace_back(Paragraph{line, Paragraph::Tone::kWarning});
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
  document.sections.push_back(
      {"Configuration", {Paragraph{"The resolved configuration is in config.resolved.yaml."}}});
  return document;
}

}  // namespace

nlohmann::json summary_of(const RunSetup& setup, const RunResult& result) {
  using nlohmann::json;
  json accuracy = json::object();
  if (result.accuracy) {
    accuracy = eval::to_json(*result.accuracy);
    accuracy["nees_planar"] = number_or_null(result.nees_planar);
  }
  for (const char* key : {"nees_pose", "nees_position", "nees_orientation"})
    accuracy[key] = nullptr;
  json calibration = json::object();
  for (int i = 0; i < setup.model->n_intrinsics(); ++i) {
    calibration[setup.model->description().intrinsics[static_cast<std::size_t>(i)].name] = {
        {"initial", setup.x_WI[i]},
        {"final", setup.x_WI[i]},
        {"sigma", setup.sigma[i]},
        {"truth", nullptr}};
  }
  json sensors = json::object();
  for (const auto& [sensor, rejection] : result.rejections) {
    sensors[sensor].push_back(
        {{"reason", rejection.reason}, {"count", rejection.count}, {"first", rejection.first}});
  }
  const PreintegratedPose& total = result.total;
  return {{"status", name(result.status)},
          {"cause", result.cause},
          {"name", setup.name},
          {"seed", setup.seed},
          {"epochs", result.epochs},
          {"duration_s", result.duration_s},
          {"wall_s", result.wall_s},
          {"accuracy", accuracy},
          {"calibration", calibration},
          {"updates", json::object()},
          {"wheels",
           {{"model", setup.kinematics.info.name},
            {"samples", total.samples},
            {"gated", total.gated},
            {"rejected", total.rejected},
            {"rank_deficient", total.rank_deficient},
            {"bridged_s", total.bridged_s},
            {"path_length_m", total.path_length_m}}},
          {"rejected_measurements", sensors},
          {"timing_ms",
           {{"preintegration", stage_json(result.preintegration_ms)},
            {"total", stage_json(result.preintegration_ms)}}},
          {"realtime_factor",
           number_or_null(result.wall_s > 0. ? result.duration_s / result.wall_s : std::nan(""))},
          {"peak_rss_mb", peak_rss_mb()}};
}

void write_run(const std::filesystem::path& folder, const RunSetup& setup,
               const RunResult& result) {
  make_folder(folder);
  write_text(folder / "config.resolved.yaml", config::to_yaml(setup.resolved));
  log::write_tum(folder / "trajectory.tum", result.estimate);
  if (!result.reference.empty()) log::write_tum(folder / "reference.tum", result.reference);
  write_text(folder / "calibration.csv", calibration_csv(setup, result));
  write_text(folder / "timing.csv", timing_csv(result));
  write_text(folder / "summary.json", summary_of(setup, result).dump(2) + "\n");
  report::write_html(folder / "report.html", document_of(setup, result));
}

std::string describe(const RunResult& result) {
  std::ostringstream out;
  out << "status " << name(result.status);
  if (!result.cause.empty()) out << ": " << result.cause;
  out << "\n"
      << significant(result.duration_s, 4) << " s, " << result.total.samples << " encoder samples";
  const PreintegratedPose& total = result.total;
  if (total.rank_deficient > 0) out << ", " << total.rank_deficient << " rank-deficient";
  if (total.gated > 0) out << ", " << total.gated << " not believed (parity gate)";
  if (total.rejected > 0) out << ", " << total.rejected << " rejected";
  if (total.bridged_s > 0.) out << ", " << significant(total.bridged_s, 3) << " s bridged";
  if (result.wall_s > 0.) {
    out << ", " << significant(result.duration_s / result.wall_s, 3) << " x real time";
  }
  out << "\n";
  if (result.accuracy) {
    const eval::Accuracy& a = *result.accuracy;
    out << "end error " << significant(1e3 * a.end_m, 4) << " mm, "
        << significant(a.end_yaw_deg * M_PI / 180., 3) << " rad yaw over "
        << significant(a.path_length_m, 4) << " m; ATE " << significant(1e3 * a.ate_m, 4) << " mm, "
        << significant(a.ate_deg, 3) << " deg\n";
  }
  for (const std::string& line : describe_rejections(result)) out << line << "\n";
  return out.str();
}

std::vector<std::string> describe_rejections(const RunResult& result) {
  std::vector<std::string> lines;
  for (const auto& [sensor, rejection] : result.rejections) {
    lines.push_back(sensor + ": " + std::to_string(rejection.count) + " x " + rejection.reason +
                    ", first at " + rejection.first);
  }
  return lines;
}

}  // namespace viwo::experiment
