#include "viwo/run/thin.hpp"

#include <algorithm>
#include <utility>

namespace viwo {
namespace {

/// Every step-th element, and the last.
class Thinner {
 public:
  explicit Thinner(std::size_t max_points) : max_points_(max_points) {}

  template <class T>
  void keep(std::vector<T>& series) const {
    const std::size_t n = series.size(), step = step_of(n);
    if (step == 1) return;
    std::vector<T> kept;
    for (std::size_t i = 0; i < n; i += step) kept.push_back(std::move(series[i]));
    if ((n - 1) % step != 0) kept.push_back(std::move(series[n - 1]));
    series = std::move(kept);
  }

  /// Each element that is kept is the sum of those since the one before.
  void sum(std::vector<int>& counts) const {
    const std::size_t n = counts.size(), step = step_of(n);
    std::vector<int> kept;
    int since = 0;
    for (std::size_t i = 0; i < n; ++i) {
      since += counts[i];
      if (i % step != 0 && i + 1 != n) continue;
      kept.push_back(since);
      since = 0;
    }
    counts = std::move(kept);
  }

 private:
  std::size_t step_of(std::size_t n) const {
    return std::max<std::size_t>(1, (n + max_points_ - 1) / max_points_);
  }
  std::size_t max_points_;
};

}  // namespace

void thin(MonitorTrack& monitor, std::size_t max_points) {
  const Thinner thinner(max_points);
  thinner.keep(monitor.t_s);
  thinner.keep(monitor.held);
  for (auto& ratios : monitor.sigma_ratio) thinner.keep(ratios);
}

void thin(RunResult& run, std::size_t max_points) {
  const Thinner thinner(max_points);
  thinner.keep(run.estimate);
  thinner.keep(run.reference);
  if (run.accuracy) {
    eval::ErrorSeries& series = run.accuracy->series;
    thinner.keep(series.t_s);
    thinner.keep(series.path_length_m);
    thinner.keep(series.position_error_m);
    thinner.keep(series.yaw_error_deg);
  }
  thinner.keep(run.epoch_ms);
  thinner.keep(run.nees.series);
  thinner.keep(run.errors);
  thinner.keep(run.epoch_t_s);
  for (CalibrationTrack& track : run.calibration) {
    thinner.keep(track.estimate);
    thinner.keep(track.sigma);
  }
  for (UpdateTrack& track : run.updates) {
    thinner.sum(track.applied);
    thinner.sum(track.rejected);
  }
  thin(run.monitor, max_points);
  run.total.J_g_WI = {};
  run.total.P_g.setZero();
  run.total.parity = {};
}

void keep_ends(RunResult& run) {
  auto nees = std::move(run.nees.series);
  thin(run, 2);
  run.nees.series = std::move(nees);
  run.final_calibration.reset();
}

void drop_last_point(RunResult& run) {
  run.estimate.pop_back();
  run.epoch_t_s.pop_back();
  run.epoch_ms.pop_back();
  for (CalibrationTrack& track : run.calibration) {
    track.estimate.pop_back();
    track.sigma.pop_back();
  }
  for (UpdateTrack& track : run.updates) {
    track.total.applied -= track.applied.back();
    track.total.rejected -= track.rejected.back();
    track.applied.pop_back();
    track.rejected.pop_back();
  }
}

}  // namespace viwo
