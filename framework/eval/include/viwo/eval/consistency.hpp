// Is a covariance honest: normalised estimation error squared (NEES) and chi-square bounds for it.
#pragma once

#include <Eigen/Core>

namespace viwo::eval {

/// error^T cov^-1 error. Distributed as chi-square with error.size() degrees of freedom when `cov`
/// is the covariance of `error`. NaN when `cov` is not positive definite; throws
/// std::invalid_argument when the sizes do not fit. Only the lower triangle of `cov` is read.
double nees(const Eigen::VectorXd& error, const Eigen::MatrixXd& cov);

/// An estimated pose, its truth, both of the IMU I in their world.
struct ErringPose {
  Eigen::Matrix3d R_GtoI, R_GtoI_true;
  Eigen::Vector3d p_IinG, p_IinG_true;  ///< m
};

/// NEES of the pose `to` as seen from the pose `from` (F-40): worlds may differ, and neither the
/// start nor the drift up to `from` has a part in it. 6 where consistent. `cov`: of the errors
/// [dtheta, dp] of `to`, then `from`, with R_GtoI_true = Exp(-dtheta) R_GtoI, p_true = p + dp.
double relative_nees(const ErringPose& from, const ErringPose& to,
                     const Eigen::Matrix<double, 12, 12>& cov);

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
