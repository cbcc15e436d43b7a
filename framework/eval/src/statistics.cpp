#include "viwo/eval/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <vector>

#include <boost/math/distributions/students_t.hpp>

namespace viwo::eval {

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace

double mean(std::span<const double> values) {
  if (values.empty()) return kNaN;
  return std::accumulate(values.begin(), values.end(), 0.) / static_cast<double>(values.size());
}

double root_mean_square(std::span<const double> values) {
  if (values.empty()) return kNaN;
  const double sum = std::inner_product(values.begin(), values.end(), values.begin(), 0.);
  return std::sqrt(sum / static_cast<double>(values.size()));
}

double sample_standard_deviation(std::span<const double> values) {
  if (values.size() < 2) return kNaN;
  const double centre = mean(values);
  double sum = 0.;
  for (const double value : values) sum += (value - centre) * (value - centre);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

double quantile(std::span<const double> values, double p) {
  if (!(p >= 0. && p <= 1.)) throw std::invalid_argument("quantile: p must be in [0, 1]");
  // NaN has no place in an order.
  const auto is_nan = [](double value) { return std::isnan(value); };
  if (values.empty() || std::any_of(values.begin(), values.end(), is_nan)) return kNaN;
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const double position = p * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const double fraction = position - static_cast<double>(below);
  // Not a blend at an exact position: it would make NaN of an infinite neighbour.
  if (fraction == 0.) return sorted[below];
  return sorted[below] + fraction * (sorted[below + 1] - sorted[below]);
}

double median(std::span<const double> values) { return quantile(values, 0.5); }

PairedDifference paired_difference(std::span<const double> a, std::span<const double> b,
                                   double confidence) {
  if (a.size() != b.size()) throw std::invalid_argument("paired_difference: sizes differ");
  if (!(confidence > 0. && confidence < 1.)) {
    throw std::invalid_argument("paired_difference: confidence must be in (0, 1)");
  }
  std::vector<double> differences;
  differences.reserve(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::isfinite(a[i]) && std::isfinite(b[i])) differences.push_back(a[i] - b[i]);
  }
  PairedDifference result;
  result.pairs = static_cast<int>(differences.size());
  result.mean = mean(differences);
  result.standard_deviation = sample_standard_deviation(differences);
  result.low = result.high = kNaN;
  if (result.pairs < 2) return result;
  const boost::math::students_t distribution(result.pairs - 1);
  const double t = boost::math::quantile(distribution, 0.5 + 0.5 * confidence);
  const double half_width = t * result.standard_deviation / std::sqrt(result.pairs);
  result.low = result.mean - half_width;
  result.high = result.mean + half_width;
  return result;
}

}  // namespace viwo::eval
