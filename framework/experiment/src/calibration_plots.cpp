// Errors of the calibration parameters over time, on the page of an experiment.
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "experiment_plots.hpp"
#include "experiment_statistics.hpp"
#include "viwo/report/curves.hpp"
#include "viwo/run/calibration_track.hpp"

namespace viwo::experiment {
namespace {

using namespace report;

constexpr std::size_t kPoints = 75;  ///< of each line: there are many

const CalibrationTrack* find(const RunResult& run, const std::string& parameter) {
  for (const CalibrationTrack& track : run.calibration) {
    if (track.name == parameter && is_estimated(run, track)) return &track;
  }
  return nullptr;
}

/// scale * y(k) over the epochs, thinned.
template <class ValueAt>
Series line(const std::string& variant, const RunResult& run, std::size_t size,
            const ValueAt& value_at) {
  Series series;
  series.name = variant;
  series.group = variant;
  const std::size_t n = std::min(size, run.epoch_t_s.size());
  const std::size_t step = std::max<std::size_t>(1, (n + kPoints - 1) / kPoints);
  for (std::size_t k = 0; k < n; k = k + 1 < n ? std::min(k + step, n - 1) : n) {
    series.x.push_back(rounded(run.epoch_t_s[k]));
    series.y.push_back(rounded(value_at(k)));
  }
  return series;
}

/// The lines of one variant: a thin one for each of the first seeds, and three sigma of the first.
void add_variant(const ExperimentResult& result, std::size_t variant, std::size_t recording,
                 const std::string& parameter, double scale, Plot& plot) {
  const std::string& name = result.setup.variants[variant].name;
  bool is_first = true;
  std::vector<Series> bounds;  // after the lines, whose look is the one of the legend
  for (const ExperimentRun& run : result.runs) {
    if (run.variant != variant || run.recording != recording || !is_drawn(result.setup, run))
      continue;
    const CalibrationTrack* track = find(run.result, parameter);
    if (track == nullptr) continue;
    const double truth = std::isfinite(track->truth) ? track->truth : 0.;
    const auto error = [&](std::size_t k) { return scale * (track->estimate[k] - truth); };
    if (std::exchange(is_first, false)) {
      for (const double sign : {-1., 1.}) {
        Series bound = line(name, run.result, track->sigma.size(), [&](std::size_t k) {
          const double middle = std::isfinite(track->truth) ? 0. : error(k);
          return middle + sign * report::kBandSigmas * scale * track->sigma[k];
        });
        bound.dash = Dash::kDotted;
        bound.width = 1.4;
        bounds.push_back(std::move(bound));
      }
    }
    Series thin = line(name, run.result, track->estimate.size(), error);
    thin.width = 1.;
    thin.opacity = 0.75;
    plot.series.push_back(std::move(thin));
  }
  for (Series& bound : bounds) plot.series.push_back(std::move(bound));
}

/// Largest prior sigma of a parameter, and whether its truth is known.
struct Scale {
  double prior_sigma = 0.;
  bool has_truth = false;
};

Scale scale_of(const ExperimentResult& result, std::size_t recording, const std::string& name) {
  Scale scale;
  for (const ExperimentRun& run : result.runs) {
    if (run.recording != recording) continue;
    if (const CalibrationTrack* track = find(run.result, name)) {
      scale.prior_sigma = std::max(scale.prior_sigma, track->sigma.front());
      scale.has_truth = scale.has_truth || std::isfinite(track->truth);
    }
  }
  return scale;
}

}  // namespace

std::vector<Block> calibration_plots(const ExperimentResult& result) {
  constexpr std::size_t kFirst = 0;  // a page with the plots of all recordings is not readable
  const auto names =
      estimated(result, [](const ExperimentRun& run) { return run.recording == kFirst; });
  if (names.empty()) return {};
  const Recording& recording = result.setup.recordings[kFirst];
  std::string text =
      "Errors of the estimates over time: a thin line for each of up to six seeds, dotted three "
      "sigma of the first";
  if (!recording.name.empty()) text += "; " + recording.name;
  std::vector<Block> blocks{Paragraph{text + "."}};
  for (const std::string& name : names) {
    const Scale scale = scale_of(result, kFirst, name);
    const auto found = result.units.find(name);
    const report::DisplayUnit unit = report::display_unit(
        found != result.units.end() ? found->second : "", scale.prior_sigma / 10.);
    Plot plot{name, "time [s]", report::with_unit(scale.has_truth ? "error" : name, unit.name)};
    plot.half_width = true;
    plot.height_px = 320;
    for (std::size_t v = 0; v < result.setup.variants.size(); ++v) {
      add_variant(result, v, kFirst, name, unit.scale, plot);
    }
    blocks.emplace_back(std::move(plot));
  }
  return blocks;
}

}  // namespace viwo::experiment
