// What an experiment leaves behind: runs.csv, summary.json, report.html, the table on the terminal.
#include <cmath>
#include <functional>
#include <sstream>

#include "viwo/eval/statistics.hpp"
#include "viwo/experiment/experiment.hpp"
#include "viwo/experiment/output.hpp"
#include "viwo/report/html.hpp"

namespace viwo::experiment {
namespace {

using nlohmann::json;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A number of a run that tables show; NaN where a run has none.
struct Metric {
  const char* key;      ///< in summary.json and runs.csv, in SI units
  const char* heading;  ///< of a table
  double table_scale;   ///< from SI to the unit of the table
  double (*of)(const RunResult&);
  double target = 0.;  ///< best value; 0: the lower the better
};

double rpe(const RunResult& run, double length_m, bool degrees) {
  if (!run.accuracy) return kNan;
  for (const auto& segment : run.accuracy->rpe) {
    if (segment.length_m == length_m) return degrees ? segment.mean_deg : segment.mean_m;
  }
  return kNan;
}

const Metric kMetrics[] = {
    {"end_m", "end [mm]", 1e3,
     [](const RunResult& r) { return r.accuracy ? r.accuracy->end_m : kNan; }},
    {"end_yaw_abs_rad", "end yaw [rad]", 1.,
     [](const RunResult& r) {
       return r.accuracy ? std::abs(r.accuracy->end_yaw_deg) * M_PI / 180. : kNan;
     }},
    {"ate_m", "ATE [mm]", 1e3,
     [](const RunResult& r) { return r.accuracy ? r.accuracy->ate_m : kNan; }},
    {"ate_deg", "ATE [deg]", 1.,
     [](const RunResult& r) { return r.accuracy ? r.accuracy->ate_deg : kNan; }},
    {"rpe_10_m", "RPE 10 m [mm]", 1e3, [](const RunResult& r) { return rpe(r, 10., false); }},
    {"rpe_10_deg", "RPE 10 m [deg]", 1., [](const RunResult& r) { return rpe(r, 10., true); }},
    {"rpe_25_m", "RPE 25 m [mm]", 1e3, [](const RunResult& r) { return rpe(r, 25., false); }},
    {"rpe_25_deg", "RPE 25 m [deg]", 1., [](const RunResult& r) { return rpe(r, 25., true); }},
    {"nees_planar", "NEES (3)", 1., [](const RunResult& r) { return r.nees_planar; }, 3.},
    {"nees_pose", "NEES (6)", 1., [](const RunResult& r) { return r.nees.pose; }, 6.},
    {"nees_position", "NEES pos (3)", 1., [](const RunResult& r) { return r.nees.position; }, 3.},
    {"nees_orientation", "NEES ori (3)", 1., [](const RunResult& r) { return r.nees.orientation; },
     3.},
    {"epoch_ms", "epoch [ms]", 1.,
     [](const RunResult& r) { return r.updates.empty() ? kNan : r.total_ms.mean_ms; }},
};

using Filter = std::function<bool(const ExperimentRun&)>;

/// Finite values of a metric over the runs of a variant that pass.
std::vector<double> values_of(const ExperimentResult& result, std::size_t variant,
                              const Metric& metric, const Filter& passes) {
  std::vector<double> values;
  for (const ExperimentRun& run : result.runs) {
    if (run.variant != variant || !passes(run)) continue;
    const double value = metric.of(run.result);
    if (std::isfinite(value)) values.push_back(value);
  }
  return values;
}

/// Mean in the unit of the table.
double table_mean(const ExperimentResult& result, std::size_t variant, const Metric& metric,
                  const Filter& passes) {
  return metric.table_scale * eval::mean(values_of(result, variant, metric, passes));
}

struct Group {
  std::string name;
  Filter passes;
};

/// All runs, then one group per value of each label in report_by, in order of appearance.
std::vector<Group> groups_of(const ExperimentResult& result) {
  std::vector<Group> groups{{"all", [](const ExperimentRun&) { return true; }}};
  for (const std::string& label : result.setup.report_by) {
    std::vector<std::string> seen;
    for (const Recording& recording : result.setup.recordings) {
      const auto found = recording.labels.find(label);
      if (found == recording.labels.end()) continue;
      if (std::find(seen.begin(), seen.end(), found->second) != seen.end()) continue;
      seen.push_back(found->second);
      const auto& recordings = result.setup.recordings;
      groups.push_back(
          {found->second, [&recordings, label, value = found->second](const ExperimentRun& run) {
             const auto& labels = recordings[run.recording].labels;
             const auto at = labels.find(label);
             return at != labels.end() && at->second == value;
           }});
    }
  }
  return groups;
}

std::int64_t count_not_ok(const ExperimentResult& result, std::size_t variant) {
  return std::count_if(result.runs.begin(), result.runs.end(), [&](const ExperimentRun& run) {
    return run.variant == variant && run.result.status != RunStatus::kOk;
  });
}

bool has_values(const ExperimentResult& result, const Metric& metric) {
  return std::any_of(result.runs.begin(), result.runs.end(), [&](const ExperimentRun& run) {
    return std::isfinite(metric.of(run.result));
  });
}

/// Final errors of one calibration parameter over the runs of a variant that estimated it.
struct CalibrationStatistics {
  std::string name;
  int runs = 0;
  double rmse = 0., mean_sigma = 0., prior_sigma = 0.;
  double nees = 0.;  ///< mean squared normalised error
};

std::vector<CalibrationStatistics> calibration_statistics(const ExperimentResult& result,
                                                          std::size_t variant) {
  std::vector<CalibrationStatistics> all;
  for (const ExperimentRun& run : result.runs) {
    if (run.variant != variant || run.result.status != RunStatus::kOk) continue;
    for (const CalibrationTrack& track : run.result.calibration) {
      if (run.result.updates.empty() || track.sigma.empty() || !(track.sigma.back() > 0.) ||
          !std::isfinite(track.final_error)) {
        continue;
      }
      auto at =
          std::find_if(all.begin(), all.end(), [&](const auto& c) { return c.name == track.name; });
      if (at == all.end()) at = all.insert(all.end(), {track.name});
      const double e = track.final_error, sigma = track.sigma.back();
      ++at->runs;
      at->rmse += e * e;
      at->mean_sigma += sigma;
      at->prior_sigma += track.sigma.front();
      at->nees += e * e / (sigma * sigma);
    }
  }
  for (CalibrationStatistics& c : all) {
    c.rmse = std::sqrt(c.rmse / c.runs);
    c.mean_sigma /= c.runs;
    c.prior_sigma /= c.runs;
    c.nees /= c.runs;
  }
  return all;
}

json summary_of(const ExperimentResult& result) {
  json variants = json::object();
  const auto all = [](const ExperimentRun&) { return true; };
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    json entry;
    std::int64_t runs = 0, diverged = 0, failed = 0, rank_deficient = 0;
    for (const ExperimentRun& run : result.runs) {
      if (run.variant != v) continue;
      ++runs;
      diverged += run.result.status == RunStatus::kDiverged;
      failed += run.result.status == RunStatus::kFailed;
      rank_deficient += run.result.total.rank_deficient;
    }
    entry = {{"runs", runs},
             {"diverged", diverged},
             {"failed", failed},
             {"rank_deficient_samples", rank_deficient}};
    for (const auto& length : {10., 25.}) {
      const std::string key = significant(length, 3);
      std::vector<double> m, deg;
      for (const ExperimentRun& run : result.runs) {
        if (run.variant != v || !std::isfinite(rpe(run.result, length, false))) continue;
        m.push_back(rpe(run.result, length, false));
        deg.push_back(rpe(run.result, length, true));
      }
      entry["rpe"][key] = {{"m", number_or_null(eval::mean(m))},
                           {"deg", number_or_null(eval::mean(deg))}};
    }
    std::vector<double> nees;
    for (const ExperimentRun& run : result.runs) {
      if (run.variant == v && std::isfinite(run.result.nees.pose)) {
        nees.push_back(run.result.nees.pose);
      }
    }
    entry["nees_pose"] = number_or_null(eval::mean(nees));
    entry["nees_pose_median"] = number_or_null(eval::median(nees));
    entry["calibration"] = json::object();
    for (const CalibrationStatistics& c : calibration_statistics(result, v)) {
      entry["calibration"][c.name] = {{"runs", c.runs},
                                      {"rmse", number_or_null(c.rmse)},
                                      {"mean_sigma", number_or_null(c.mean_sigma)},
                                      {"prior_sigma", number_or_null(c.prior_sigma)},
                                      {"nees", number_or_null(c.nees)}};
    }
    for (const Metric& metric : kMetrics) {
      const auto values = values_of(result, v, metric, all);
      entry["metrics"][metric.key] = {
          {"mean", number_or_null(eval::mean(values))},
          {"median", number_or_null(eval::median(values))},
          {"std", number_or_null(eval::sample_standard_deviation(values))}};
    }
    variants[result.setup.variants[v].name] = entry;
  }
  return {{"experiment", result.setup.name}, {"wall_s", result.wall_s}, {"variants", variants}};
}

std::string runs_csv(const ExperimentResult& result) {
  std::ostringstream csv;
  csv.precision(12);
  csv << "variant,recording,seed,status,duration_s,wall_s,samples,rank_deficient,gated";
  for (const Metric& metric : kMetrics) csv << ',' << metric.key;
  csv << '\n';
  for (const ExperimentRun& run : result.runs) {
    csv << result.setup.variants[run.variant].name << ','
        << result.setup.recordings[run.recording].name << ',' << run.seed << ','
        << name(run.result.status) << ',' << run.result.duration_s << ',' << run.result.wall_s
        << ',' << run.result.total.samples << ',' << run.result.total.rank_deficient << ','
        << run.result.total.gated;
    for (const Metric& metric : kMetrics) {
      csv << ',';
      if (const double value = metric.of(run.result); std::isfinite(value)) csv << value;
    }
    csv << '\n';
  }
  return csv.str();
}

report::Table table_of(const ExperimentResult& result, const Group& group) {
  report::Table table;
  table.caption = group.name == "all" ? "Mean over all runs" : "Mean over: " + group.name;
  table.columns = {{"variant"}, {"runs"}, {"not ok"}};
  for (const Metric& metric : kMetrics) {
    if (!has_values(result, metric)) continue;
    table.columns.push_back({metric.heading,
                             {},
                             metric.target > 0. ? report::Best::kNearest : report::Best::kLowest,
                             metric.target});
  }
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    std::vector<report::Cell> row{result.setup.variants[v].name};
    const auto runs = std::count_if(result.runs.begin(), result.runs.end(), [&](const auto& run) {
      return run.variant == v && group.passes(run);
    });
    row.emplace_back(static_cast<double>(runs));
    row.emplace_back(static_cast<double>(count_not_ok(result, v)));
    for (const Metric& metric : kMetrics) {
      if (!has_values(result, metric)) continue;
      row.emplace_back(table_mean(result, v, metric, group.passes));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

/// One row per parameter, per variant rmse / mean sigma and NEES.
report::Table calibration_table(const ExperimentResult& result, std::size_t variant) {
  report::Table table;
  table.caption = "Calibration at the end: " + result.setup.variants[variant].name;
  table.columns = {{"parameter"},
                   {"runs"},
                   {"prior sigma"},
                   {"rmse"},
                   {"mean sigma"},
                   {"rmse / prior"},
                   {"NEES (1)", {}, report::Best::kNearest, 1.}};
  for (const CalibrationStatistics& c : calibration_statistics(result, variant)) {
    table.rows.push_back(
        {c.name, c.runs, c.prior_sigma, c.rmse, c.mean_sigma, c.rmse / c.prior_sigma, c.nees});
  }
  return table;
}

/// Trajectory and error of the first seed of every recording.
void add_recording_plots(const ExperimentResult& result, report::Document& document) {
  for (std::size_t r = 0; r < result.setup.recordings.size(); ++r) {
    const Recording& recording = result.setup.recordings[r];
    std::string heading = recording.name.empty() ? "Trajectories" : recording.name;
    for (const std::string& label : result.setup.report_by) {
      const auto found = recording.labels.find(label);
      if (found != recording.labels.end() && found->second != recording.name) {
        heading = found->second + ", recording " + recording.name;
      }
    }
    report::Plot top{"Seen from above", "x [m]", "y [m]"};
    top.equal_axes = top.half_width = true;
    report::Plot error{"Position error over path length", "path length [m]", "error [mm]"};
    error.half_width = true;
    std::vector<bool> seen(result.setup.variants.size(), false);
    for (const ExperimentRun& run : result.runs) {
      if (run.recording != r || seen[run.variant]) continue;
      seen[run.variant] = true;
      const std::string& variant = result.setup.variants[run.variant].name;
      if (top.series.empty() && !run.result.reference.empty()) {
        top.series.push_back(trajectory_series("truth", run.result.reference, 300));
        top.series.back().reference = true;
      }
      top.series.push_back(trajectory_series(variant, run.result.estimate, 300));
      if (run.result.accuracy) {
        error.series.push_back(error_series(variant, *run.result.accuracy, 300));
      }
    }
    document.sections.push_back({heading, {top, error}});
  }
}

}  // namespace

void write_experiment(const std::filesystem::path& folder, const ExperimentResult& result) {
  make_folder(folder);
  write_text(folder / "runs.csv", runs_csv(result));
  write_text(folder / "summary.json", summary_of(result).dump(2) + "\n");
  report::Document document{result.setup.name,
                            std::to_string(result.setup.variants.size()) + " variants, " +
                                std::to_string(result.setup.recordings.size()) + " recordings, " +
                                std::to_string(result.setup.seeds) + " seeds",
                            {{"Summary", {}}}};
  for (const Group& group : groups_of(result)) {
    document.sections[0].blocks.emplace_back(table_of(result, group));
  }
  for (const ExperimentRun& run : result.runs) {
    if (run.result.status == RunStatus::kOk) continue;
    document.sections[0].blocks.emplace_back(
        report::Paragraph{result.setup.variants[run.variant].name + " " +
                              result.setup.recordings[run.recording].name + ": " + run.result.cause,
                          report::Paragraph::Tone::kWarning});
  }
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    report::Table table = calibration_table(result, v);
    if (!table.rows.empty()) document.sections[0].blocks.emplace_back(std::move(table));
  }
  add_recording_plots(result, document);
  report::write_html(folder / "report.html", document);
}

static std::string describe_calibration(const ExperimentResult& result) {
  std::ostringstream out;
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    const auto statistics = calibration_statistics(result, v);
    if (statistics.empty()) continue;
    out << "\ncalibration of " << result.setup.variants[v].name
        << ": rmse at the end (part of the prior sigma; NEES, 1 is consistent)\n";
    std::size_t column = 0;
    for (const CalibrationStatistics& c : statistics) {
      const std::string text = "  " + c.name + " " + significant(c.rmse, 3) + " (" +
                               significant(100. * c.rmse / c.prior_sigma, 3) + " %; " +
                               significant(c.nees, 3) + ")";
      out << text << std::string(text.size() < 42 ? 42 - text.size() : 1, ' ');
      if (++column % 3 == 0) out << "\n";
    }
    if (column % 3 != 0) out << "\n";
  }
  return out.str();
}

std::string describe(const ExperimentResult& result) {
  std::ostringstream out;
  std::size_t width = 8;
  for (const Variant& variant : result.setup.variants) width = std::max(width, variant.name.size());
  const auto cell = [&](const std::string& text, std::size_t size) {
    out << "  " << std::string(size > text.size() ? size - text.size() : 0, ' ') << text;
  };
  for (const Group& group : groups_of(result)) {
    out << "\n"
        << group.name
        << std::string(width > group.name.size() ? width - group.name.size() : 0, ' ');
    cell("not ok", 6);
    for (const Metric& metric : kMetrics) {
      if (has_values(result, metric)) cell(metric.heading, 14);
    }
    out << "\n";
    for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
      const std::string& variant = result.setup.variants[v].name;
      out << variant << std::string(width - variant.size(), ' ');
      cell(std::to_string(count_not_ok(result, v)), 6);
      for (const Metric& metric : kMetrics) {
        if (!has_values(result, metric)) continue;
        cell(significant(table_mean(result, v, metric, group.passes), 4), 14);
      }
      out << "\n";
    }
  }
  out << describe_calibration(result);
  return out.str();
}

}  // namespace viwo::experiment
