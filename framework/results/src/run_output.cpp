// What a run leaves behind: tables, trajectories, summary.json, report.html.
#include "viwo/results/run_output.hpp"

#include <cmath>
#include <ostream>

#include <sys/resource.h>

#include "viwo/config/yaml.hpp"
#include "viwo/eval/json.hpp"
#include "viwo/files/files.hpp"
#include "viwo/log/tum.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/text_stream.hpp"
#include "viwo/report/html.hpp"
#include "viwo/results/metrics.hpp"
#include "viwo/results/run_stream.hpp"
#include "viwo/setup/calibration_values.hpp"

namespace viwo {

const char* viwo_version() { return VIWO_VERSION; }

namespace {

double peak_rss_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.;
}

nlohmann::json stage_json(const StageTime& stage) {
  return {
      {"mean", stage.mean_ms}, {"p95", stage.p95_ms}, {"p99", stage.p99_ms}, {"max", stage.max_ms}};
}

void write_calibration(const std::filesystem::path& file, const RunResult& result) {
  files::TextWriter out(file);
  write_calibration_head(out);
  for (std::size_t k = 0; k < result.epoch_t_s.size(); ++k) write_calibration_rows(out, result, k);
  out.close();
}

void write_timing(const std::filesystem::path& file, const RunResult& result) {
  files::TextWriter out(file);
  write_timing_head(out);
  for (std::size_t k = 0; k < result.epoch_ms.size(); ++k) write_timing_row(out, result, k);
  out.close();
}

/// What a next run starts from; of a run that did not end well it says so, and is refused.
void write_start_of_next(const std::filesystem::path& file, const RunSetup& setup,
                         const RunResult& result) {
  if (!result.final_calibration) return;
  using Status = CalibrationFile::Status;
  CalibrationFile calibration = *result.final_calibration;
  describe_rig(setup, calibration);
  const bool has_estimates = !calibration.intrinsics.empty() || !calibration.cameras.empty();
  if (!has_estimates) return;
  if (result.status != RunStatus::kOk) {
    const bool diverged = result.status == RunStatus::kDiverged;
    calibration.status = diverged ? Status::kDiverged : Status::kFailed;
    calibration.reasons = {result.cause};
  } else if (!result.doubts.empty()) {
    calibration.status = Status::kDoubtful;
    calibration.reasons = result.doubts;
  }
  files::write_text(file, calibration_text(calibration, "viwo run"));
}

/// The trajectory of each piece of a run that has several.
void write_pieces(const std::filesystem::path& folder, const RunResult& result) {
  if (result.pieces.size() < 2) return;
  auto pose = result.estimate.begin();
  for (std::size_t k = 0; k < result.pieces.size(); ++k) {
    const auto end = pose + result.pieces[k].epochs;
    log::write_tum(piece_file(folder, k), Trajectory(pose, end));
    pose = end;
  }
}

nlohmann::json pieces_json(const std::vector<RunPiece>& pieces) {
  nlohmann::json all = nlohmann::json::array();
  for (const RunPiece& piece : pieces) {
    all.push_back({{"begin_s", 1e-9 * static_cast<double>(piece.begin_ns)},
                   {"end_s", 1e-9 * static_cast<double>(piece.end_ns)},
                   {"epochs", piece.epochs},
                   {"failure", piece.failure}});
  }
  return all;
}

nlohmann::json calibration_json(const RunResult& result) {
  nlohmann::json calibration = nlohmann::json::object();
  for (const CalibrationTrack& track : result.calibration) {
    if (track.estimate.empty()) continue;
    calibration[track.name] = {{"initial", track.estimate.front()},
                               {"final", number_or_null(track.estimate.back())},
                               {"sigma", number_or_null(track.sigma.back())},
                               {"truth", number_or_null(track.truth)},
                               {"error", number_or_null(track.final_error)},
                               {"scatter", track.scatter}};
  }
  return calibration;
}

bool has_monitor(const MonitorTrack& monitor) {
  return !monitor.t_s.empty() || !monitor.warnings.empty();
}

nlohmann::json monitor_json(const MonitorTrack& monitor) {
  nlohmann::json warnings = nlohmann::json::array();
  for (const MonitorWarning& warning : monitor.warnings) {
    warnings.push_back(
        {{"time_s", warning.t_s}, {"text", warning.text}, {"parameters", warning.parameters}});
  }
  nlohmann::json last = nlohmann::json::object();
  for (std::size_t i = 0; i < monitor.parameters.size(); ++i) {
    if (monitor.sigma_ratio[i].empty()) continue;
    last[monitor.parameters[i]] = number_or_null(monitor.sigma_ratio[i].back());
  }
  return {{"warnings", warnings}, {"sigma_ratio", last}};
}

/// What the wheels of a run without filter gave.
nlohmann::json wheels_json(const RunSetup& setup, const PreintegratedPose& total) {
  return {{"model", setup.kinematics.info.name},
          {"samples", total.samples},
          {"gated", total.gated},
          {"rejected", total.rejected},
          {"rank_deficient", total.rank_deficient},
          {"bridged_s", total.bridged_s},
          {"path_length_m", total.path_length_m}};
}

nlohmann::json accuracy_json(const RunSetup& setup, const RunResult& result) {
  nlohmann::json accuracy = nlohmann::json::object();
  if (result.accuracy) accuracy = eval::to_json(*result.accuracy);
  if (!setup.filter && result.accuracy) {
    accuracy["nees_planar"] = number_or_null(result.nees_planar);
  }
  accuracy["nees_pose"] = number_or_null(result.nees.pose);
  accuracy["nees_position"] = number_or_null(result.nees.position);
  accuracy["nees_orientation"] = number_or_null(result.nees.orientation);
  accuracy["nees_relative"] = number_or_null(result.nees.relative);
  return accuracy;
}

nlohmann::json rejected_json(const RunResult& result) {
  nlohmann::json rejected = nlohmann::json::object();
  for (const auto& [source, rejection] : result.rejections) {
    rejected[source].push_back(
        {{"reason", rejection.reason}, {"count", rejection.count}, {"first", rejection.first}});
  }
  return rejected;
}

nlohmann::json noises_json(const RunResult& result) {
  nlohmann::json noises = nlohmann::json::object();
  for (const NoiseFound& noise : result.noises) {
    noises[noise.name] = {{"unit", noise.unit},
                          {"configured", noise.configured},
                          {"found", noise.found},
                          {"count", noise.count}};
  }
  return noises;
}

nlohmann::json updates_json(const RunResult& result) {
  nlohmann::json updates = nlohmann::json::object();
  for (const UpdateTrack& update : result.updates) {
    updates[update.name] = {{"applied", update.total.applied},
                            {"rejected", update.total.rejected},
                            {"failed", update.failures.count},
                            {"disabled", update.failures.disabled}};
    if (update.failures.count > 0) updates[update.name]["cause"] = update.failures.cause;
  }
  return updates;
}

}  // namespace

nlohmann::json summary_of(const RunSetup& setup, const RunResult& result) {
  using nlohmann::json;
  json metrics = json::object();
  for (const Metric& metric : metrics_over(segment_lengths_m(result))) {
    metrics[metric.key] = number_or_null(metric.of(result));
  }
  json timing = json::object();
  for (const auto& [stage, time] : result.stages) timing[stage] = stage_json(time);
  timing["total"] = stage_json(result.total_ms);
  json summary = {
      {"viwo_version", viwo_version()},
      {"status", status_text(result)},
      {"cause", result.cause},
      {"doubts", result.doubts},
      {"warnings", result.warnings},
      {"noises", noises_json(result)},
      {"name", setup.name},
      {"seed", setup.seed},
      {"epochs", result.epochs},
      {"duration_s", result.duration_s},
      {"wall_s", result.wall_s},
      {"pieces", pieces_json(result.pieces)},
      {"accuracy", accuracy_json(setup, result)},
      {"metrics", metrics},
      {"calibration", calibration_json(result)},
      {"updates", updates_json(result)},
      {"rejected_measurements", rejected_json(result)},
      {"timing_ms", timing},
      {"realtime_factor",
       number_or_null(result.wall_s > 0. ? result.duration_s / result.wall_s : std::nan(""))},
      {"peak_rss_mb", peak_rss_mb()}};
  if (has_monitor(result.monitor)) summary["monitor"] = monitor_json(result.monitor);
  if (!setup.filter) summary["wheels"] = wheels_json(setup, result.total);
  return summary;
}

void write_run(const std::filesystem::path& folder, const RunSetup& setup,
               const RunResult& result) {
  files::NewResults out(folder);
  files::write_text(out.file("config.resolved.yaml"), config::to_yaml(setup.resolved));
  if (!result.on_disk) {
    log::write_tum(out.file("trajectory.tum"), result.estimate);
    write_pieces(out.folder(), result);
    write_calibration(out.file("calibration.csv"), result);
    write_timing(out.file("timing.csv"), result);
  }
  if (!result.reference.empty()) log::write_tum(out.file("reference.tum"), result.reference);
  write_start_of_next(out.file("calibration.yaml"), setup, result);
  files::write_text(out.file("summary.json"), json_text(summary_of(setup, result)));
  files::write_text(out.file("report.html"), report::to_html(report_of(setup, result)));
  if (!result.on_disk) remove_piece_files(folder);
  out.commit({"summary.json", "report.html", "calibration.yaml", "reference.tum"});
}

namespace {

void describe_odometry(const PreintegratedPose& total, std::ostream& out) {
  out << total.samples << " encoder samples";
  if (total.rank_deficient > 0) out << ", " << total.rank_deficient << " rank-deficient";
  if (total.gated > 0) out << ", " << total.gated << " not believed (parity gate)";
  if (total.rejected > 0) out << ", " << total.rejected << " rejected";
  if (total.bridged_s > 0.) out << ", " << significant(total.bridged_s, 3) << " s bridged";
}

}  // namespace

std::string describe(const RunResult& result) {
  TextStream out;
  out << "status " << status_text(result);
  if (!result.cause.empty()) out << ": " << result.cause;
  for (const std::string& doubt : result.doubts) out << "\n  " << doubt;
  out << "\n" << significant(result.duration_s, 4) << " s, ";
  if (result.updates.empty() && result.total.samples > 0) {
    describe_odometry(result.total, out);
  } else {
    out << result.epochs << " epochs";
    for (const UpdateTrack& update : result.updates) {
      out << "; " << update.name << " " << update.total.applied;
      if (update.total.rejected > 0) out << " (" << update.total.rejected << " rejected)";
    }
  }
  if (result.wall_s > 0. && !result.live) {
    out << ", " << significant(result.duration_s / result.wall_s, 3) << " x real time";
  }
  out << "\n";
  if (result.accuracy) {
    const eval::Accuracy& a = *result.accuracy;
    out << "end error " << significant(1e3 * a.end_m, 4) << " mm, "
        << significant(a.end_yaw_deg * M_PI / 180., 3) << " rad yaw over "
        << significant(a.path_length_m, 4) << " m; ATE " << significant(1e3 * a.ate_m, 4) << " mm, "
        << significant(a.ate_deg, 3) << " deg\n";
  } else if (!result.live && result.reference.empty()) {
    out << "no reference: accuracy unknown\n";
  }
  if (std::isfinite(result.end_sigma.position_m)) {
    out << "the filter's own sigma at the end " << significant(1e3 * result.end_sigma.position_m, 3)
        << " mm, " << significant(result.end_sigma.yaw_rad, 3) << " rad yaw\n";
  }
  if (std::isfinite(result.nees.pose)) {
    // Of an estimate that is not far off it is hardly its own.
    constexpr double kHardlyItsOwn = 30., kPart = 0.02, kNear_deg = 2.;
    const bool is_near = result.accuracy &&
                         result.accuracy->ate_m < kPart * result.accuracy->path_length_m &&
                         result.accuracy->ate_deg < kNear_deg;
    out << "NEES of the pose " << significant(result.nees.pose, 3) << " (6 is consistent"
        << (result.nees.pose > kHardlyItsOwn && is_near
                ? "; how good the reference is, viwo inspect tells by the IMU"
                : "")
        << "); epoch " << significant(result.total_ms.mean_ms, 3) << " ms mean, "
        << significant(result.total_ms.p95_ms, 3) << " ms p95\n";
  }
  for (const NoiseFound& noise : result.noises) {
    out << "noise " << noise.name << ": " << found_text(noise) << " " << noise.unit
        << (noise.unit.empty() ? "" : " ") << "found, " << significant(noise.configured, 3)
        << " configured\n";
  }
  for (const MonitorWarning& warning : result.monitor.warnings) {
    out << "at " << significant(warning.t_s, 4) << " s: " << warning.text << "\n";
  }
  for (const std::string& line : result.warnings) out << "warning: " << line << "\n";
  for (const std::string& line : describe_failures(result)) out << "warning: " << line << "\n";
  for (const std::string& line : describe_rejections(result)) out << line << "\n";
  return out.str();
}

std::string found_text(const NoiseFound& noise) {
  constexpr double kLeastTold = 0.1;  // NoiseScale tells no less
  const bool is_told = noise.found > 1.0001 * kLeastTold * noise.configured;
  return (is_told ? "" : "at most ") + significant(noise.found, 3);
}

std::vector<std::string> describe_failures(const RunResult& result) {
  std::vector<std::string> lines;
  for (const UpdateTrack& update : result.updates) {
    const UpdateFailures& failures = update.failures;
    if (failures.count == 0) continue;
    lines.push_back("update '" + update.name + "' failed in " + std::to_string(failures.count) +
                    (failures.count == 1 ? " epoch" : " epochs") +
                    (failures.disabled ? " and was disabled: " : ", which it skipped: ") +
                    failures.cause);
  }
  return lines;
}

std::vector<std::string> describe_rejections(const RunResult& result) {
  std::vector<std::string> lines;
  for (const auto& [sensor, rejection] : result.rejections) {
    lines.push_back(sensor + ": " + std::to_string(rejection.count) + " x " + rejection.reason +
                    ", first at " + rejection.first);
  }
  return lines;
}

}  // namespace viwo
