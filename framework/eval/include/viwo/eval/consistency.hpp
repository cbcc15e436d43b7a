// Is a covariance honest: normalised estimation error squared (NEES) and chi-square bounds for it.
#pragma once

#include <Eigen/Core>

namespace viwo::eval {

/// error^T cov^-1 error. Distributed as chi-square with error.size() degrees of freedom when `cov`
/// is the covariance of `error`. NaN when `cov` is not positive definite; throws
/// std::invalid_argument when the sizes do not fit. Only the lower triangle of `cov` is read.
double nees(const Eigen::VectorXd& error, const Eigen::MatrixXd& cov);

/// The value below which a chi-square variable with `dof` degrees of freedom stays with probability
/// `p`. Throws std::invalid_argument unless 0 <= p < 1 and dof > 0.
double chi2_quantile(double p, double dof);

/// Two-sided interval for a mean NEES.
struct NeesBounds {
  double low = 0.;
  double high = 0.;
};

/// Interval in which the mean NEES of `runs` independent runs lies with probability `confidence`
/// when the filter is consistent; the expected value is `dof`. Throws std::invalid_argument unless
/// dof > 0, runs > 0 and 0 < confidence < 1.
NeesBounds mean_nees_bounds(int dof, int runs, double confidence);

}  // namespace viwo::eval
