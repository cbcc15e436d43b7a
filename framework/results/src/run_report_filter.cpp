// The parts of a run's page that tell what the estimator did.
#include <algorithm>
#include <cmath>

#include "run_report.hpp"
#include "viwo/math/chi2.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/report/curves.hpp"
#include "viwo/results/run_output.hpp"
#include "viwo/run/calibration_track.hpp"

namespace viwo {
namespace {

using namespace report;

constexpr int kPlotHeight = 300;
constexpr int kStagesHeight = 350;  ///< the names of the stages need some of it

Plot half_plot(const std::string& title, const std::string& x_label, const std::string& y_label) {
  Plot plot{title, x_label, y_label};
  plot.half_width = true;
  plot.height_px = kPlotHeight;
  return plot;
}

Series coloured(Series series, int colour) {
  series.colour = colour;
  return series;
}

/// Largest of errors and bands; the unit of their axis follows from it.
double largest(const std::vector<double>& errors, const std::vector<double>& sigmas) {
  double most = 0.;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    for (const double value : {std::abs(errors[i]), report::kBandSigmas * sigmas[i]}) {
      if (std::isfinite(value)) most = std::max(most, value);
    }
  }
  return most;
}

/// One component of RunResult::errors.
struct ErrorTrack {
  std::string title;
  std::string si_unit;
  std::vector<double> error, sigma;
};

std::vector<ErrorTrack> error_tracks(const RunResult& result) {
  std::vector<ErrorTrack> tracks{{"Position error along x", "m", {}, {}},
                                 {"Position error along y", "m", {}, {}},
                                 {"Position error along z (up)", "m", {}, {}},
                                 {"Yaw error", "rad", {}, {}}};
  for (const PoseError& error : result.errors) {
    for (int i = 0; i < 3; ++i) {
      tracks[static_cast<std::size_t>(i)].error.push_back(error.position_m[i]);
      tracks[static_cast<std::size_t>(i)].sigma.push_back(error.position_sigma_m[i]);
    }
    tracks[3].error.push_back(error.yaw_rad);
    tracks[3].sigma.push_back(error.yaw_sigma_rad);
  }
  return tracks;
}

Plot nees_plot(const PoseNees& nees) {
  constexpr double kDegreesOfFreedom = 6., kOutside = 0.05;
  const double low = chi2_quantile(kOutside / 2., kDegreesOfFreedom);
  const double high = chi2_quantile(1. - kOutside / 2., kDegreesOfFreedom);
  std::vector<double> t_s, values;
  for (const auto& [t, value] : nees.series) {
    t_s.push_back(t);
    values.push_back(value);
  }
  const auto inside = std::count_if(values.begin(), values.end(),
                                    [&](double value) { return value >= low && value <= high; });
  Plot plot{"Normalised estimation error squared (NEES) of the pose", "time [s]", "NEES [1]"};
  plot.height_px = kPlotHeight;
  plot.log_y = true;
  plot.series.push_back(coloured(report::curve("NEES", {t_s, values}), kEstimateColour));
  plot.series.back().width = 1.2;
  Series mean;
  mean.name = "mean " + significant(nees.pose, 3);
  mean.x = {t_s.front(), t_s.back()};
  mean.y = {nees.pose, nees.pose};
  mean.dash = Dash::kDashed;
  plot.series.push_back(coloured(std::move(mean), kSecondColour));
  plot.lines = {{ReferenceLine::Direction::kHorizontal, low, "2.5 %"},
                {ReferenceLine::Direction::kHorizontal, high, "97.5 %"}};
  Range shown;
  for (const double value : values) {
    if (value > 0.) shown.add(value);
  }
  shown.add(low);
  shown.add(high);
  plot.y_range = std::pair{0.8 * shown.low, 1.25 * shown.high};
  plot.caption =
      "A consistent filter has mean 6 and stays between the dotted bounds " + significant(low, 3) +
      " and " + significant(high, 3) +
      " (chi-square, 6 degrees of freedom) for 95 % of the time; here it did for " +
      significant(100. * static_cast<double>(inside) / static_cast<double>(values.size()), 3) +
      " %.";
  return plot;
}

/// Columns of equal width in time with the mean of what falls into them.
struct Bins {
  double begin_s;
  double width_s = 1.;
  std::size_t count = 0;

  explicit Bins(const std::vector<double>& t_s) : begin_s(t_s.front()) {
    constexpr double kMaxBins = 300.;
    const double duration_s = t_s.back() - begin_s;
    width_s = std::max(1., std::ceil(duration_s / kMaxBins));
    count = static_cast<std::size_t>(duration_s / width_s) + 1;
  }
  std::size_t index(double t_s) const {
    return std::min(count - 1, static_cast<std::size_t>(std::max(0., (t_s - begin_s) / width_s)));
  }
};

/// Sums of `counts` per second of time, in the middle of each bin. The last bin, which is not full,
/// is left out unless it is the only one.
Series rate(const std::string& name, const Bins& bins, const std::vector<double>& t_s,
            const std::vector<int>& counts, int colour) {
  std::vector<double> sums(bins.count, 0.);
  const std::size_t n = std::min(t_s.size(), counts.size());
  for (std::size_t i = 0; i < n; ++i) sums[bins.index(t_s[i])] += counts[i];
  if (sums.size() > 1) sums.pop_back();
  Series series;
  series.name = name;
  series.colour = colour;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    series.x.push_back(bins.begin_s + (static_cast<double>(i) + 0.5) * bins.width_s);
    series.y.push_back(sums[i] / bins.width_s);
  }
  return series;
}

report::DisplayUnit unit_of(const CalibrationTrack& track) {
  return report::display_unit(track.unit, report::kBandSigmas * track.sigma.back());
}

/// A range of y that shows how a parameter ends: all after the first fifth of the run. Nothing when
/// there is little to gain over showing everything.
std::optional<std::pair<double, double>> settled_range(const Series& series, double truth) {
  constexpr double kStartPart = 0.2, kMargin = 0.3, kMinGain = 2.5;
  Range all, settled;
  const double settled_s = series.x.front() + kStartPart * (series.x.back() - series.x.front());
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    for (const double end : {series.y_low[i], series.y_high[i]}) {
      all.add(end);
      if (series.x[i] >= settled_s) settled.add(end);
    }
  }
  settled.add(truth);
  const double margin = kMargin * (settled.high - settled.low);
  const bool worth = std::isfinite(margin) && margin > 0. &&
                     all.high - all.low > kMinGain * (settled.high - settled.low + 2. * margin);
  if (!worth) return std::nullopt;
  return std::pair{settled.low - margin, settled.high + margin};
}

Plot calibration_plot(const RunResult& result, const CalibrationTrack& track) {
  const report::DisplayUnit unit = unit_of(track);
  Plot plot = half_plot(track.name, "time [s]", report::with_unit(track.name, unit.name));
  const std::size_t n = std::min(result.epoch_t_s.size(), track.estimate.size());
  const std::span<const double> t_s(result.epoch_t_s.data(), n);
  plot.series.push_back(coloured(
      report::curve("estimate, 3 sigma",
                    {t_s, {track.estimate.data(), n}, {track.sigma.data(), n}, unit.scale}, 600),
      kEstimateColour));
  plot.y_range = settled_range(plot.series.front(), unit.scale * track.truth);
  if (std::isfinite(track.truth)) {
    plot.series.push_back(report::truth_line(t_s.front(), t_s.back(), unit.scale * track.truth));
  }
  return plot;
}

/// Every so many columns of the monitor's track so that a page can show them.
HeatMap excitation_map(const MonitorTrack& monitor) {
  constexpr std::size_t kMaxColumns = 120;
  HeatMap map;
  map.y = monitor.parameters;
  map.z.resize(map.y.size());
  map.colour_label = "sigma after / before";
  map.z_min = 0.;
  map.z_max = 1.;
  const std::size_t step =
      std::max<std::size_t>(1, (monitor.t_s.size() + kMaxColumns - 1) / kMaxColumns);
  for (std::size_t k = 0; k < monitor.t_s.size(); k += step) {
    map.x.push_back(significant(monitor.t_s[k], 4));
    for (std::size_t i = 0; i < map.y.size(); ++i) {
      map.z[i].push_back(monitor.sigma_ratio[i][k]);
    }
  }
  return map;
}

Table rejections_table(const RunResult& result) {
  Table table;
  table.caption = "Measurements that were not used";
  table.columns = {{"count"}, {"source"}, {"reason"}, {"first"}};
  for (const auto& [source, rejection] : result.rejections) {
    table.rows.push_back({rejection.count, source, rejection.reason, rejection.first});
  }
  return table;
}

}  // namespace

void add_error_section(const RunResult& result, Document& document) {
  if (result.errors.empty()) return;
  Section section{"Error and its bounds", {}};
  section.blocks.emplace_back(Paragraph{
      "Estimate minus truth; the bands are three of the filter's own sigmas around zero."});
  std::vector<double> t_s;
  for (const PoseError& error : result.errors) t_s.push_back(error.t_s);
  const auto tracks = error_tracks(result);
  double most_m = 0.;  // one unit for all of the position
  for (std::size_t i = 0; i < 3; ++i) {
    most_m = std::max(most_m, largest(tracks[i].error, tracks[i].sigma));
  }
  for (const ErrorTrack& track : tracks) {
    const bool position = track.si_unit == "m";
    const report::DisplayUnit unit =
        report::display_unit(track.si_unit, position ? most_m : largest(track.error, track.sigma));
    Plot plot = half_plot(track.title, "time [s]", report::with_unit("error", unit.name));
    plot.series.push_back(
        coloured(report::error_curve("error", {t_s, track.error, track.sigma, unit.scale}),
                 kEstimateColour));
    section.blocks.emplace_back(std::move(plot));
  }
  if (!result.nees.series.empty()) section.blocks.emplace_back(nees_plot(result.nees));
  document.sections.push_back(std::move(section));
}

void add_calibration_section(const RunResult& result, Document& document) {
  if (result.epoch_t_s.empty()) return;
  Table table;
  table.caption = "Estimated parameters, their truth and what was believed at the end";
  table.columns = {{"parameter"}, {"unit"},  {"initial"}, {"prior sigma"},     {"final"},
                   {"sigma"},     {"truth"}, {"|error|"}, {"|error| / sigma"}, {"scatter / sigma"}};
  std::vector<Block> plots;
  std::string held;
  for (const CalibrationTrack& track : result.calibration) {
    if (!is_estimated(result, track)) {
      held += (held.empty() ? "" : ", ") + track.name;
      continue;
    }
    const report::DisplayUnit unit = unit_of(track);
    const double sigma = track.sigma.back();
    table.rows.push_back({track.name, unit.name, unit.scale * track.estimate.front(),
                          unit.scale * track.sigma.front(), unit.scale * track.estimate.back(),
                          unit.scale * sigma, unit.scale * track.truth,
                          std::abs(unit.scale * track.final_error),
                          std::abs(track.final_error) / sigma, track.scatter});
    plots.emplace_back(calibration_plot(result, track));
  }
  if (plots.empty()) return;
  Section section{"Calibration", {std::move(table)}};
  section.blocks.emplace_back(Paragraph{
      "The bands are three of the filter's own sigmas around the estimate. Where a parameter is "
      "found quickly, its plot shows what comes after that; a double click shows all. "
      "Scatter is by how many times its sigma a parameter moves as it is learned: where it is not "
      "1, the noise of what is measured lasts, and calibration.yaml has the sigma times that."});
  if (!held.empty()) {
    section.blocks.emplace_back(
        Paragraph{"Not estimated, held at the configured value: " + held + "."});
  }
  std::move(plots.begin(), plots.end(), std::back_inserter(section.blocks));
  document.sections.push_back(std::move(section));
}

void add_noise_section(const RunResult& result, Document& document) {
  if (result.noises.empty()) return;
  Table table;
  table.caption = "Noise as it was found while the filter ran";
  table.columns = {{"parameter"}, {"unit"}, {"configured"}, {"found"}, {"measurements"}};
  for (const NoiseFound& noise : result.noises) {
    table.rows.push_back({noise.name, noise.unit, noise.configured, found_text(noise),
                          static_cast<double>(noise.count)});
  }
  document.sections.push_back({"Noise", {std::move(table)}});
}

void add_excitation_section(const RunResult& result, Document& document) {
  const MonitorTrack& monitor = result.monitor;
  if (monitor.t_s.empty() && monitor.warnings.empty()) return;
  Section section{"Excitation", {}};
  section.blocks.emplace_back(Paragraph{
      "What the recent motion alone told about each parameter: the sigma that it would leave of "
      "the prior sigma. 1: the motion told nothing."});
  for (const MonitorWarning& warning : monitor.warnings) {
    section.blocks.emplace_back(
        Paragraph{significant(warning.t_s, 4) + " s: " + warning.text, Paragraph::Tone::kWarning});
  }
  if (!monitor.t_s.empty() && !monitor.parameters.empty()) {
    Plot plot{"Excitation of the calibration over time", "time [s]", ""};
    plot.heat_map = excitation_map(monitor);
    section.blocks.emplace_back(std::move(plot));
  }
  const auto most = std::max_element(monitor.held.begin(), monitor.held.end());
  if (most != monitor.held.end() && *most > 0) {
    const std::vector<double> held(monitor.held.begin(), monitor.held.end());
    Plot plot{"Directions of the calibration that are held", "time [s]", "directions [1]"};
    plot.height_px = kPlotHeight;
    plot.series.push_back(coloured(report::curve("held", {monitor.t_s, held}), kEstimateColour));
    section.blocks.emplace_back(std::move(plot));
  }
  document.sections.push_back(std::move(section));
}

void add_measurements_section(const RunResult& result, Document& document) {
  Section section{"Updates and gates", {}};
  for (const std::string& line : describe_failures(result)) {
    section.blocks.emplace_back(Paragraph{line, Paragraph::Tone::kWarning});
  }
  if (!result.updates.empty() && !result.epoch_t_s.empty()) {
    Table table;
    table.caption = "Factors of each update";
    table.columns = {{"update"}, {"applied"}, {"rejected"}, {"rejected [%]"}};
    std::vector<Block> plots;
    const Bins bins(result.epoch_t_s);
    for (const UpdateTrack& update : result.updates) {
      const auto sum = static_cast<double>(update.total.applied + update.total.rejected);
      table.rows.push_back({update.name, update.total.applied, update.total.rejected,
                            100. * static_cast<double>(update.total.rejected) / sum});
      Plot plot = half_plot(update.name, "time [s]", "factors [1/s]");
      plot.series = {rate("applied", bins, result.epoch_t_s, update.applied, kEstimateColour),
                     rate("rejected", bins, result.epoch_t_s, update.rejected, kSecondColour)};
      plots.emplace_back(std::move(plot));
    }
    section.blocks.emplace_back(std::move(table));
    std::move(plots.begin(), plots.end(), std::back_inserter(section.blocks));
  }
  if (!result.rejections.empty()) section.blocks.emplace_back(rejections_table(result));
  if (!section.blocks.empty()) document.sections.push_back(std::move(section));
}

void add_time_section(const RunResult& result, Document& document) {
  if (result.epoch_ms.empty()) return;
  Section section{"Time", {}};
  Plot stages = half_plot("Time of an epoch by stage", "", "time [ms]");
  stages.height_px = kStagesHeight;
  Series mean, p95;
  mean.name = "mean";
  p95.name = "95th percentile";
  for (const auto& [stage, time] : result.stages) {
    mean.categories.push_back(stage);
    p95.categories.push_back(stage);
    mean.y.push_back(time.mean_ms);
    p95.y.push_back(time.p95_ms);
  }
  for (Series* series : {&mean, &p95}) series->draw = Draw::kBars;
  stages.series = {coloured(std::move(mean), kEstimateColour),
                   coloured(std::move(p95), kSecondColour)};
  if (!result.stages.empty()) section.blocks.emplace_back(std::move(stages));
  std::vector<double> t_s, ms;
  for (const auto& [t, spent] : result.epoch_ms) {
    t_s.push_back(t);
    ms.push_back(spent);
  }
  Plot epochs = half_plot("Time of each epoch", "time [s]", "time [ms]");
  epochs.height_px = kStagesHeight;
  epochs.series.push_back(coloured(report::curve("epoch", {t_s, ms}), kEstimateColour));
  epochs.series.back().width = 1.;
  epochs.caption = "Mean " + significant(result.total_ms.mean_ms, 3) + " ms, 95th percentile " +
                   significant(result.total_ms.p95_ms, 3) + " ms, largest " +
                   significant(result.total_ms.max_ms, 3) + " ms.";
  section.blocks.emplace_back(std::move(epochs));
  document.sections.push_back(std::move(section));
}

}  // namespace viwo
