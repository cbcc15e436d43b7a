// Curves of the plots of a page, and the units that they are shown in.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <string>

#include "viwo/eval/accuracy.hpp"
#include "viwo/math/trajectory.hpp"
#include "viwo/report/document.hpp"

namespace viwo::report {

/// Points of a curve that a page shows without getting slow.
inline constexpr std::size_t kMaxCurvePoints = 1200;

/// How values of an SI unit are shown: value * scale, in `name`.
struct DisplayUnit {
  std::string name;
  double scale = 1.;
};

/// mm, mrad, ms and their like where values as large as `magnitude`, in `si_unit`, read better in
/// them; `si_unit` itself otherwise, and for units without such a prefix.
DisplayUnit display_unit(const std::string& si_unit, double magnitude);

/// "heading [unit]"; the heading alone without a unit.
std::string with_unit(const std::string& heading, const std::string& unit);

/// The limits of finite values.
struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void add(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  bool empty() const { return !(low <= high); }
  double size() const { return empty() ? 0. : high - low; }
};

/// Half the width of the bands of a page.
inline constexpr double kBandSigmas = 3.;

/// What a curve is made of; all spans of one size.
struct CurveData {
  std::span<const double> x;
  std::span<const double> y;
  std::span<const double> sigma = {};  ///< empty: no band
  double scale = 1.;                   ///< of y and sigma
};

/// y over x as a curve, with a three-sigma band around it if there are sigmas; thinned.
Series curve(const std::string& name, const CurveData& data,
             std::size_t max_points = kMaxCurvePoints);

/// An error over x as a curve, with the band from minus to plus three sigma around zero; thinned.
Series error_curve(const std::string& name, const CurveData& data,
                   std::size_t max_points = kMaxCurvePoints);

/// The truth, which does not change, as a dashed line over a curve's x from `begin` to `end`.
Series truth_line(double begin, double end, double truth);

/// Trajectory as a curve of a plot, thinned to at most `max_points`.
Series trajectory_series(const std::string& name, const Trajectory& trajectory,
                         std::size_t max_points = 600);

/// Position error over the reference's path length as a curve, thinned likewise.
Series error_series(const std::string& name, const eval::Accuracy& accuracy,
                    std::size_t max_points = 600);

}  // namespace viwo::report
