#include "viwo/api/noise_scale.hpp"

#include <algorithm>
#include <cmath>

namespace viwo {

double NoiseScale::scale() const { return std::sqrt(variance_); }

void NoiseScale::add(double variance, double weight) {
  if (!enabled_ || !std::isfinite(variance) || !(weight >= 0.)) return;
  const double kept = 1. - weight / memory_;
  sum_ = kept * sum_ + weight * variance;
  weight_ = kept * weight_ + weight;
  // Residuals that are smaller than configured do not tell that the noise is: what is common to
  // many of them (calibration, a rigid board, slip) is not in their scatter.
  variance_ = std::max(1., bounded(sum_ / weight_));
  total_ += weight * variance;
  total_weight_ += weight;
  ++count_;
}

double NoiseScale::found() const { return std::sqrt(bounded(total_ / total_weight_)); }

double NoiseScale::bounded(double variance) const {
  constexpr double kLeast = 0.1;  // what is smaller is the error of the estimate
  return std::clamp(variance, kLeast * kLeast, most_ * most_);
}

}  // namespace viwo
