#include "viwo/api/noise_scale.hpp"

#include <algorithm>
#include <cmath>

namespace viwo {

double NoiseScale::scale() const { return std::sqrt(variance_); }

void NoiseScale::reset() {
  variance_ = 1.;
  sum_ = weight_ = total_ = total_weight_ = believed_;
  beyond_ = 0.;
  count_ = 0;
}

void NoiseScale::add(double variance, double weight) {
  if (!enabled_ || !std::isfinite(variance) || !(weight >= 0.)) return;
  remember(variance, weight, 1. - weight / memory_);
  total_ += weight * variance;
  total_weight_ += weight;
  ++count_;
  beyond_ = beyond_ > 0. ? -beyond_ : 0.;
}

void NoiseScale::add_beyond_in_turn(double gate) {
  if (!enabled_) return;
  const double said = variance_ * gate;
  const bool is_second = beyond_ != 0.;
  if (is_second) {  // (F-39)
    sum_ = 2. * variance_ + std::abs(beyond_);
    weight_ = 3.;
  }
  remember(said, 1., is_second ? 1. : 1. - 1. / memory_);
  // What is reported is not what a scale that was raised makes of outliers.
  total_ += std::min(said, gate * total_ / total_weight_);
  total_weight_ += 1.;
  ++count_;
  beyond_ = said;
}

/// Forgets all but `kept`.
void NoiseScale::remember(double variance, double weight, double kept) {
  sum_ = kept * sum_ + weight * variance;
  weight_ = kept * weight_ + weight;
  // Residuals that are smaller than configured do not tell that the noise is: what is common to
  // many of them (calibration, a rigid board, slip) is not in their scatter.
  variance_ = std::max(1., bounded(sum_ / weight_));
}

double NoiseScale::found() const { return std::sqrt(bounded(total_ / total_weight_)); }

double NoiseScale::bounded(double variance) const {
  constexpr double kLeast = 0.1;  // what is smaller is the error of the estimate
  return std::clamp(variance, kLeast * kLeast, most_ * most_);
}

void NoiseScale::append_to(const char* name, const char* unit, double configured,
                           std::vector<NoiseFound>& out) const {
  if (count_ > 0) out.push_back({name, unit, configured, configured * found(), count_});
}

}  // namespace viwo
