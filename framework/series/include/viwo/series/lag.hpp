// By how much one sensor says a turn later than another: where their rates correlate most.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "viwo/series/rate_grid.hpp"

namespace viwo::series {

struct Lag {
  double lag_s = 0.;           ///< > 0: `b` says it later than `a`
  double sigma_s = 0.;         ///< by leaving out a tenth of the time in turn
  double correlation = 0.;     ///< there; < 0: of opposite sign
  double at_zero = 0.;         ///< correlation without a lag
  double slope = 0.;           ///< least squares of b by a, there
  double rate_rad_per_s = 0.;  ///< standard deviation of a
  /// In each tenth that turns enough, at its middle [s since the grid begins].
  std::vector<std::pair<double, double>> parts;
};

/// Nothing where there is too little rotation, or too little in common. `a`, `b` are grids of one
/// begin and size. `most_s`: how far to look; where the two are not alike so near, lags of half a
/// minute (a third of the time) are tried, to 0.03 s and without `parts`.
std::optional<Lag> find_lag(const RateGrid& a, const RateGrid& b, double most_s = 1.);

/// The rotation that takes the rates of `a` best to those of `b`, at the lag at which
/// they are most alike once they are rotated. Nothing where they are not alike even then
/// (correlation below 0.8), or turn about one axis only: then the second singular value of their
/// products is less than a tenth of the first.
std::optional<Eigen::Matrix3d> rotation_between(const RateGrid& a, const RateGrid& b);

}  // namespace viwo::series
