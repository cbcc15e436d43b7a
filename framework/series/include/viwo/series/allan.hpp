// Allan deviation of readings at equal steps: how much means over a time differ from those over the
// next. White noise of density N gives N / sqrt(tau), a random walk of density K gives
// K sqrt(tau / 3).
#pragma once

#include <vector>

namespace viwo::series {

struct AllanPoint {
  double tau_s = 0.;
  double deviation = 0.;
  double terms = 0.;  ///< means without overlap that it is made of
};

/// At times in powers of two of the step, up to a quarter of the whole; overlapping means.
std::vector<AllanPoint> allan_deviation(const std::vector<double>& values, double step_s);

}  // namespace viwo::series
