#include "viwo/report/curves.hpp"

#include <algorithm>

namespace viwo::report {

DisplayUnit display_unit(const std::string& si_unit, double magnitude) {
  const bool has_prefixes = si_unit == "m" || si_unit == "rad" || si_unit == "s" ||
                            si_unit == "m/s" || si_unit == "rad/s";
  if (has_prefixes && magnitude < 0.1) return {"m" + si_unit, 1e3};
  return {si_unit, 1.};
}

std::string with_unit(const std::string& heading, const std::string& unit) {
  return unit.empty() ? heading : heading + " [" + unit + "]";
}

namespace {

/// Every k-th index so that at most `max_points` remain, and the last.
template <class F>
void thinned(std::size_t size, std::size_t max_points, const F& take) {
  const std::size_t step = std::max<std::size_t>(1, (size + max_points - 1) / max_points);
  for (std::size_t i = 0; i < size; i += step) take(i);
  if (size > 0 && (size - 1) % step != 0) take(size - 1);
}

/// The band is around the curve, or around zero.
Series banded(const std::string& name, const CurveData& data, bool around_zero,
              std::size_t max_points) {
  Series series;
  series.name = name;
  thinned(data.x.size(), max_points, [&](std::size_t i) {
    const double y = data.scale * data.y[i];
    series.x.push_back(data.x[i]);
    series.y.push_back(y);
    if (data.sigma.empty()) return;
    const double middle = around_zero ? 0. : y;
    const double band = kBandSigmas * data.scale * data.sigma[i];
    series.y_low.push_back(middle - band);
    series.y_high.push_back(middle + band);
  });
  return series;
}

}  // namespace

Series curve(const std::string& name, const CurveData& data, std::size_t max_points) {
  return banded(name, data, false, max_points);
}

Series error_curve(const std::string& name, const CurveData& data, std::size_t max_points) {
  return banded(name, data, true, max_points);
}

Series truth_line(double begin, double end, double truth) {
  Series series;
  series.name = "truth";
  series.reference = true;
  series.x = {begin, end};
  series.y = {truth, truth};
  return series;
}

Series trajectory_series(const std::string& name, const Trajectory& trajectory,
                         std::size_t max_points) {
  Series series;
  series.name = name;
  series.group = name;
  thinned(trajectory.size(), max_points, [&](std::size_t i) {
    series.x.push_back(trajectory[i].p_BinW.x());
    series.y.push_back(trajectory[i].p_BinW.y());
  });
  return series;
}

Series error_series(const std::string& name, const eval::Accuracy& accuracy,
                    std::size_t max_points) {
  const eval::ErrorSeries& errors = accuracy.series;
  return curve(name, {errors.path_length_m, errors.position_error_m, {}, 1e3}, max_points);
}

}  // namespace viwo::report
