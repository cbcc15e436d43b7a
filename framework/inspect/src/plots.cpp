#include "plots.hpp"

#include <algorithm>
#include <cmath>

#include "viwo/checks/checks.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/report/curves.hpp"
#include "viwo/series/rate_grid.hpp"

namespace viwo::inspect {

using series::Recording;
using series::Stamps;
using series::Turn;
using series::turns_of;
using series::Wheels;

namespace {

using report::Plot;
using report::Series;

/// Of every bin of a curve the smallest and the largest value, so that no gap is thinned away.
Series thinned(const std::string& name, const std::vector<double>& x,
               const std::vector<double>& y) {
  constexpr std::size_t kBins = report::kMaxCurvePoints / 2;
  Series series;
  series.name = name;
  const std::size_t size = std::max<std::size_t>(1, x.size() / kBins);
  for (std::size_t i = 0; i < x.size(); i += size) {
    const std::size_t end = std::min(x.size(), i + size);
    std::size_t low = i, high = i;
    for (std::size_t k = i; k < end; ++k) {
      if (y[k] < y[low]) low = k;
      if (y[k] > y[high]) high = k;
    }
    const auto add = [&](std::size_t k) {
      series.x.push_back(x[k]);
      series.y.push_back(y[k]);
    };
    add(std::min(low, high));
    if (low != high) add(std::max(low, high));
  }
  return series;
}

Plot intervals(const Recording& recording) {
  Plot plot{"Intervals between samples", "time [s]", "interval [ms]"};
  plot.log_y = true;
  plot.caption = "Gaps stand out, jitter is a band.";
  for (const Stamps& stamps : recording.stamps) {
    std::vector<double> x, y;
    for (std::size_t i = 1; i < stamps.t_ns.size(); ++i) {
      const double interval_s = seconds_between(stamps.t_ns[i - 1], stamps.t_ns[i]);
      if (interval_s <= 0.) continue;
      x.push_back(seconds_between(recording.begin_ns(), stamps.t_ns[i]));
      y.push_back(1e3 * interval_s);
    }
    if (x.empty()) continue;
    std::string name = recording.label(stamps.sensor, *stamps.type);
    if (stamps.channel > 0) name += ", camera " + std::to_string(stamps.channel);
    plot.series.push_back(thinned(name, x, y));
  }
  return plot;
}

Plot force(const Recording& recording) {
  Plot plot{"Accelerometer", "time [s]", "magnitude [m/s^2]"};
  std::vector<double> x, y;
  for (const ImuSample& sample : recording.imu) {
    x.push_back(seconds_between(recording.begin_ns(), sample.t_ns));
    y.push_back(to_vector(sample.accel_m_per_s2).norm());
  }
  plot.series.push_back(thinned("specific force", x, y));
  if (recording.setup->filter) {
    plot.lines.push_back({report::ReferenceLine::Direction::kHorizontal,
                          recording.setup->filter->options.filter.gravity_m_per_s2,
                          "gravity, configured"});
  }
  return plot;
}

Series rate_curve(const Recording& recording, const std::string& name,
                  const std::vector<Turn>& turns) {
  std::vector<double> x, y;
  for (const Turn& turn : turns) {
    x.push_back(seconds_between(recording.begin_ns(), turn.begin_ns / 2 + turn.end_ns / 2));
    y.push_back(turn.rate.z());
  }
  return thinned(name, x, y);
}

Plot rates(const Recording& recording) {
  Plot plot{"Yaw rates", "time [s]", "rate [rad/s]"};
  plot.caption = "Of one base: alike in sign, size and time.";
  const Eigen::Vector3d up = up_of(recording.imu);
  if (up.norm() > 0.) {
    plot.series.push_back(rate_curve(recording, recording.label<ImuSample>(recording.imu_sensor),
                                     about(turns_of(recording.imu), up)));
  }
  for (const Wheels& wheels : recording.wheels) {
    if (wheels.samples.empty()) continue;
    plot.series.push_back(
        rate_curve(recording, recording.label<EncoderSample>(wheels.sensor), turns_of(wheels)));
  }
  return plot;
}

}  // namespace

std::vector<Plot> plots_of(const Recording& recording) {
  std::vector<Plot> plots;
  const auto add = [&](Plot plot) {
    if (!plot.series.empty()) plots.push_back(std::move(plot));
  };
  add(intervals(recording));
  if (!recording.imu.empty()) add(force(recording));
  add(rates(recording));
  return plots;
}

}  // namespace viwo::inspect
