#include "experiment_plots.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "experiment_statistics.hpp"
#include "viwo/eval/consistency.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/report/curves.hpp"
#include "viwo/run/calibration_track.hpp"

namespace viwo::experiment {
namespace {

using namespace report;

/// Curves that differ by more than this factor are only seen together on a logarithmic axis.
constexpr double kLogarithmicFrom = 20.;

constexpr int kMapHeight = 560;  ///< and of the plot beside it, px

Series series_of(const std::string& variant) {
  Series series;
  series.name = variant;
  series.group = variant;
  return series;
}

double largest(const Series& series) {
  double most = 0.;
  for (const double y : series.y) {
    if (std::isfinite(y)) most = std::max(most, std::abs(y));
  }
  return most;
}

/// Absolute values on an axis that shows the best and the worst curve.
void finish_magnitudes(Plot& plot) {
  double least = kNan, most = 0.;
  for (const Series& series : plot.series) {
    if (series.dash != Dash::kSolid) continue;
    const double top = largest(series);
    if (top > 0.) least = std::isfinite(least) ? std::min(least, top) : top;
    most = std::max(most, top);
  }
  plot.log_y = most > kLogarithmicFrom * least;
  for (Series& series : plot.series) {
    for (double& y : series.y) y = plot.log_y && !(y > 0.) ? kNan : rounded(y);
  }
}

/// Position and yaw error of one run, as magnitudes with their three sigma where the filter has
/// them.
void add_errors(const RunResult& run, const std::string& variant, Plot& position, Plot& yaw) {
  constexpr double kDegrees = 180. / M_PI;
  Series p = series_of(variant), p3 = p, a = p, a3 = p;
  p3.dash = a3.dash = Dash::kDotted;
  p3.width = a3.width = 1.2;
  for (const PoseError& error : run.errors) {
    for (Series* series : {&p, &p3, &a, &a3}) series->x.push_back(rounded(error.t_s));
    p.y.push_back(error.position_m.norm());
    p3.y.push_back(report::kBandSigmas * error.position_sigma_m.norm());
    a.y.push_back(kDegrees * std::abs(error.yaw_rad));
    a3.y.push_back(kDegrees * report::kBandSigmas * error.yaw_sigma_rad);
  }
  if (run.errors.empty() && run.accuracy) {
    const eval::ErrorSeries& series = run.accuracy->series;
    for (std::size_t i = 0; i < series.t_s.size(); ++i) {
      p.x.push_back(rounded(series.t_s[i]));
      p.y.push_back(series.position_error_m[i]);
      a.x.push_back(rounded(series.t_s[i]));
      a.y.push_back(std::abs(series.yaw_error_deg[i]));
    }
  }
  if (p.x.empty()) return;
  position.series.push_back(std::move(p));
  yaw.series.push_back(std::move(a));
  if (p3.x.empty()) return;
  position.series.push_back(std::move(p3));
  yaw.series.push_back(std::move(a3));
}

/// Mean over the runs that are ok, where all of them have an epoch.
Series mean_nees(const ExperimentResult& result, std::size_t variant, std::size_t recording,
                 int& runs) {
  std::map<std::int64_t, std::pair<double, int>> sums;  // by time in ms
  runs = 0;
  for (const ExperimentRun& run : result.runs) {
    if (run.variant != variant || run.recording != recording) continue;
    if (run.result.status != RunStatus::kOk || run.result.nees.series.empty()) continue;
    ++runs;
    for (const auto& [t_s, value] : run.result.nees.series) {
      auto& [sum, count] = sums[std::llround(1e3 * t_s)];
      sum += value;
      ++count;
    }
  }
  Series series = series_of(result.setup.variants[variant].name);
  for (const auto& [t_ms, sum] : sums) {
    if (sum.second != runs) continue;
    series.x.push_back(1e-3 * static_cast<double>(t_ms));
    series.y.push_back(rounded(sum.first / runs));
  }
  return series;
}

/// NEES of the pose over time; nothing when no variant has one.
std::optional<Plot> nees_plot(const ExperimentResult& result, std::size_t recording) {
  constexpr int kPoseDof = 6;
  Plot plot{"Consistency of the pose (NEES)", "time [s]", "mean NEES"};
  plot.half_width = true;
  plot.height_px = kMapHeight;
  int least_runs = 0, most_runs = 0;
  double most = 0., least = kNan;
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    int runs = 0;
    Series series = mean_nees(result, v, recording, runs);
    if (series.x.empty()) continue;
    const double mean = std::accumulate(series.y.begin(), series.y.end(), 0.) /
                        static_cast<double>(series.y.size());
    most = std::max(most, mean);
    least = std::isfinite(least) ? std::min(least, mean) : mean;
    least_runs = least_runs == 0 ? runs : std::min(least_runs, runs);
    most_runs = std::max(most_runs, runs);
    plot.series.push_back(std::move(series));
  }
  if (plot.series.empty()) return std::nullopt;
  const eval::NeesBounds bounds = eval::mean_nees_bounds(kPoseDof, least_runs, kConfidence);
  plot.log_y = most > kLogarithmicFrom * std::min(least, static_cast<double>(kPoseDof));
  plot.lines = {{ReferenceLine::Direction::kHorizontal, bounds.low, ""},
                {ReferenceLine::Direction::kHorizontal, bounds.high, "95 %"}};
  plot.caption =
      "Mean over " +
      (least_runs < most_runs ? std::to_string(least_runs) + " to " : std::string()) +
      std::to_string(most_runs) + (most_runs == 1 ? " run" : " runs") +
      ". A consistent filter has 6 and is between the dashed lines for 95 % of the time.";
  return plot;
}

/// Position error at the end of every run.
Plot end_error_plot(const ExperimentResult& result, std::size_t recording) {
  Plot plot{"Error at the end of each run", "seed", "position error [m]"};
  plot.half_width = true;
  plot.height_px = kMapHeight;
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    Series series = series_of(result.setup.variants[v].name);
    series.draw = Draw::kMarkers;
    for (const ExperimentRun& run : result.runs) {
      if (run.variant != v || run.recording != recording || !run.result.accuracy) continue;
      series.x.push_back(static_cast<double>(run.seed));
      series.y.push_back(rounded(run.result.accuracy->end_m));
    }
    if (!series.x.empty()) plot.series.push_back(std::move(series));
  }
  return plot;
}

std::string heading_of(const ExperimentSetup& setup, const Recording& recording) {
  if (recording.name.empty()) return "Trajectories and errors";
  const std::string& motion = motion_of(setup, recording);
  return motion == recording.name ? motion : motion + ", recording " + recording.name;
}

/// The first run of each variant on a recording that got anywhere.
std::vector<const ExperimentRun*> first_runs(const ExperimentResult& result,
                                             std::size_t recording) {
  std::vector<const ExperimentRun*> runs;
  for (const ExperimentRun& run : result.runs) {
    if (run.recording != recording || run.result.estimate.empty()) continue;
    if (runs.empty() || runs.back()->variant != run.variant) runs.push_back(&run);
  }
  return runs;
}

/// A trajectory with no more digits than can be seen.
Series path_series(const std::string& name, const Trajectory& trajectory) {
  Series series = report::trajectory_series(name, trajectory);
  for (auto* values : {&series.x, &series.y}) {
    for (double& value : *values) value = 1e-4 * std::round(1e4 * value);
  }
  return series;
}

/// The true path; a dot where the robot stood still, for a line without length is not seen.
Series truth_series(const Trajectory& reference) {
  constexpr double kStandsStill_m = 0.005;
  Series series = path_series("truth", reference);
  series.reference = true;
  const auto [x_low, x_high] = std::minmax_element(series.x.begin(), series.x.end());
  const auto [y_low, y_high] = std::minmax_element(series.y.begin(), series.y.end());
  if (std::max(*x_high - *x_low, *y_high - *y_low) < kStandsStill_m) {
    series.draw = Draw::kMarkers;
    series.x.resize(1);
    series.y.resize(1);
  }
  return series;
}

/// Variant and parameter: mean of final sigma / prior sigma over the runs of a motion.
double sigma_ratio(const ExperimentResult& result, std::size_t variant, const std::string& motion,
                   const std::string& parameter) {
  std::vector<double> ratios;
  for (const ExperimentRun& run : result.runs) {
    if (run.variant != variant || run.result.status != RunStatus::kOk) continue;
    if (motion_of(result.setup, result.setup.recordings[run.recording]) != motion) continue;
    for (const CalibrationTrack& track : run.result.calibration) {
      if (track.name == parameter && is_estimated(run.result, track)) {
        ratios.push_back(track.sigma.back() / track.sigma.front());
      }
    }
  }
  return eval::mean(ratios);
}

struct MapColumn {
  std::string name;
  std::size_t variant;
  std::string motion;
};

Plot ratio_map(const ExperimentResult& result, const std::string& title,
               const std::vector<std::string>& parameters, const std::vector<MapColumn>& columns) {
  HeatMap map;
  map.colour_label = "log10 of the ratio";
  map.z_min = -3.;  // one scale for all maps; what is below is dark
  map.z_max = 0.;
  map.y = parameters;
  for (const MapColumn& column : columns) map.x.push_back(column.name);
  for (const std::string& parameter : parameters) {
    auto& z = map.z.emplace_back();
    auto& text = map.text.emplace_back();
    for (const MapColumn& column : columns) {
      const double ratio = sigma_ratio(result, column.variant, column.motion, parameter);
      z.push_back(rounded(std::log10(ratio)));
      text.push_back(std::isfinite(ratio) ? significant(ratio, 2) : "");
    }
  }
  Plot plot{title, "", ""};
  plot.heat_map = std::move(map);
  plot.height_px = static_cast<int>(140 + 22 * parameters.size());
  plot.caption =
      "What is left of the prior sigma at the end, mean over the runs: 1 means that nothing was "
      "learned.";
  return plot;
}

}  // namespace

double rounded(double value) {
  if (!std::isfinite(value) || value == 0.) return value;
  const double unit = std::pow(10., std::floor(std::log10(std::abs(value))) - 4.);
  if (!(unit >= std::numeric_limits<double>::min())) return 0.;
  return std::stod(significant(std::round(value / unit) * unit, 5));
}

const std::string& motion_of(const ExperimentSetup& setup, const Recording& recording) {
  for (const std::string& label : setup.report_by) {
    const auto found = recording.labels.find(label);
    if (found != recording.labels.end()) return found->second;
  }
  return recording.name;
}

std::vector<Section> recording_sections(const ExperimentResult& result) {
  std::vector<Section> sections;
  for (std::size_t r = 0; r < result.setup.recordings.size(); ++r) {
    Plot top{"Seen from above", "x [m]", "y [m]"};
    Plot position{"Position error", "time [s]", "error [m]"};
    Plot yaw{"Yaw error", "time [s]", "error [deg]"};
    top.equal_axes = top.half_width = position.half_width = yaw.half_width = true;
    top.height_px = kMapHeight;
    for (const ExperimentRun* run : first_runs(result, r)) {
      const std::string& variant = result.setup.variants[run->variant].name;
      if (top.series.empty() && !run->result.reference.empty()) {
        top.series.push_back(truth_series(run->result.reference));
      }
      const eval::Alignment alignment =
          run->result.accuracy ? run->result.accuracy->alignment : eval::Alignment::kNone;
      top.series.push_back(path_series(
          variant, eval::aligned(run->result.reference, run->result.estimate, alignment)));
      add_errors(run->result, variant, position, yaw);
    }
    Section section{heading_of(result.setup, result.setup.recordings[r]), {}};
    if (!top.series.empty()) section.blocks.emplace_back(std::move(top));
    std::optional<Plot> nees = nees_plot(result, r);
    if (nees) section.blocks.emplace_back(std::move(*nees));
    if (!nees && result.setup.seeds > 1) section.blocks.emplace_back(end_error_plot(result, r));
    for (Plot* plot : {&position, &yaw}) {
      if (plot->series.empty()) continue;
      finish_magnitudes(*plot);
      plot->caption = "Magnitude, of the first seed of each variant";
      plot->caption += nees ? "; dotted: three sigma of the filter." : ".";
      section.blocks.emplace_back(std::move(*plot));
    }
    sections.push_back(std::move(section));
  }
  return sections;
}

std::vector<Block> sigma_ratio_maps(const ExperimentResult& result) {
  std::vector<std::string> motions;
  for (const Recording& recording : result.setup.recordings) {
    add_once(motions, motion_of(result.setup, recording));
  }
  std::vector<Block> maps;
  std::vector<MapColumn> variants;
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    const auto parameters =
        estimated(result, [v](const ExperimentRun& run) { return run.variant == v; });
    if (parameters.empty()) continue;
    const std::string& name = result.setup.variants[v].name;
    variants.push_back({name, v, motions.front()});
    if (motions.size() == 1) continue;
    std::vector<MapColumn> columns;
    for (const std::string& motion : motions) columns.push_back({motion, v, motion});
    maps.emplace_back(ratio_map(result,
                                "Observability by motion, final sigma / prior sigma: " + name,
                                parameters, columns));
  }
  if (motions.size() == 1 && !variants.empty()) {
    maps.emplace_back(ratio_map(result, "Observability, final sigma / prior sigma",
                                estimated(result, [](const ExperimentRun&) { return true; }),
                                variants));
  }
  return maps;
}

std::vector<Block> stage_plots(const ExperimentResult& result) {
  std::vector<std::string> stages;
  for (const ExperimentRun& run : result.runs) {
    if (run.result.updates.empty()) continue;
    for (const auto& [stage, time] : run.result.stages) add_once(stages, stage);
  }
  Plot plot{"Time per epoch", "", "mean [ms]"};
  for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
    Series series = series_of(result.setup.variants[v].name);
    series.draw = Draw::kBars;
    for (const std::string& stage : stages) {
      std::vector<double> ms;
      for (const ExperimentRun& run : result.runs) {
        if (run.variant != v || run.result.updates.empty()) continue;
        for (const auto& [name, time] : run.result.stages) {
          if (name == stage) ms.push_back(time.mean_ms);
        }
      }
      if (ms.empty()) continue;
      series.categories.push_back(stage);
      series.y.push_back(rounded(eval::mean(ms)));
    }
    if (!series.y.empty()) plot.series.push_back(std::move(series));
  }
  if (plot.series.empty()) return {};
  plot.caption = "CPU time of the thread; runs side by side take longer than one alone.";
  return {plot};
}

}  // namespace viwo::experiment
