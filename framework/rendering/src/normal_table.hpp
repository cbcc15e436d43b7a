// Normal noise for each pixel of an image.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace viwo::rendering {

/// Quantiles of the standard normal distribution, scaled to unit variance: fast noise.
class NormalTable {
 public:
  static constexpr int kBits = 12;
  NormalTable() {
    double sum = 0.;
    for (std::size_t i = 0; i < values_.size(); ++i) {
      const double x =
          quantile((static_cast<double>(i) + 0.5) / static_cast<double>(values_.size()));
      values_[i] = static_cast<float>(x);
      sum += x * x;
    }
    const auto scale = static_cast<float>(std::sqrt(static_cast<double>(values_.size()) / sum));
    for (float& value : values_) value *= scale;
  }
  float operator[](std::uint64_t bits) const { return values_[bits & (values_.size() - 1)]; }

 private:
  static double quantile(double p) {
    double x = 0.;
    for (int i = 0; i < 100; ++i) {  // Newton's method
      const double error = 0.5 * std::erfc(-x / std::sqrt(2.)) - p;
      const double slope = std::exp(-0.5 * x * x) / std::sqrt(2. * M_PI);
      const double step = std::clamp(error / slope, -0.5, 0.5);
      x -= step;
      if (std::abs(step) < 1e-12) break;
    }
    return x;
  }

  std::array<float, std::size_t{1} << kBits> values_{};
};

}  // namespace viwo::rendering
