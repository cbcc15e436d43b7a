// Small sample statistics for experiments: what the mean is, how sure one can be of a difference.
#pragma once

#include <span>

namespace viwo::eval {

/// Arithmetic mean; NaN without values.
double mean(std::span<const double> values);

/// Root of the mean square; NaN without values.
double root_mean_square(std::span<const double> values);

/// Standard deviation with n - 1 in the denominator; NaN for fewer than two values.
double sample_standard_deviation(std::span<const double> values);

/// Quantile by linear interpolation between the order statistics at position p (n - 1), 0 <= p
/// <= 1. NaN without values or when one is NaN; throws std::invalid_argument for p outside of [0,
/// 1].
double quantile(std::span<const double> values, double p);

/// quantile(values, 0.5).
double median(std::span<const double> values);

/// Mean of a - b over pairs and its two-sided confidence interval by Student's t.
struct PairedDifference {
  int pairs = 0;                   ///< pairs that were used: both values finite
  double mean = 0.;                ///< mean of a - b; NaN without pairs
  double standard_deviation = 0.;  ///< of a - b; NaN for fewer than two pairs
  double low = 0.;                 ///< lower end of the interval; NaN for fewer than two pairs
  double high = 0.;                ///< upper end of the interval
};

/// Differences a[i] - b[i] of runs that share everything (the seed) but the variant. Pairs with a
/// value that is not finite (a diverged run) are left out. Throws std::invalid_argument when the
/// sizes differ or 0 < confidence < 1 does not hold.
PairedDifference paired_difference(std::span<const double> a, std::span<const double> b,
                                   double confidence = 0.95);

}  // namespace viwo::eval
