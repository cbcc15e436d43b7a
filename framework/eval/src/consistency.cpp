#include "viwo/eval/consistency.hpp"

#include <limits>
#include <stdexcept>

#include <Eigen/Cholesky>

#include "viwo/math/chi2.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::eval {

double nees(const Eigen::VectorXd& error, const Eigen::MatrixXd& cov) {
  if (cov.rows() != error.size() || cov.cols() != error.size()) {
    throw std::invalid_argument("nees: error and covariance differ in size");
  }
  const Eigen::LLT<Eigen::MatrixXd> cholesky(cov);
  // A NaN in `cov` passes through the factorisation and comes out as NaN all the same.
  if (cholesky.info() != Eigen::Success) return std::numeric_limits<double>::quiet_NaN();
  return cholesky.matrixL().solve(error).squaredNorm();
}

double relative_nees(const ErringPose& from, const ErringPose& to,
                     const Eigen::Matrix<double, 12, 12>& cov) {
  const Eigen::Matrix3d R = to.R_GtoI * from.R_GtoI.transpose();
  const Eigen::Matrix3d R_true = to.R_GtoI_true * from.R_GtoI_true.transpose();
  const Eigen::Vector3d p = from.R_GtoI * (to.p_IinG - from.p_IinG);
  const Eigen::Vector3d p_true = from.R_GtoI_true * (to.p_IinG_true - from.p_IinG_true);
  Eigen::Matrix<double, 6, 1> error;
  error << -log_so3(R_true * R.transpose()), p_true - p;
  Eigen::Matrix<double, 6, 12> H = Eigen::Matrix<double, 6, 12>::Zero();
  H.block<3, 3>(0, 0).setIdentity();
  H.block<3, 3>(0, 6) = -R;
  H.block<3, 3>(3, 3) = from.R_GtoI;
  H.block<3, 3>(3, 6) = skew(p);
  H.block<3, 3>(3, 9) = -from.R_GtoI;
  return nees(error, H * cov * H.transpose());
}

NeesBounds mean_nees_bounds(int dof, int runs, double confidence) {
  if (dof <= 0 || runs <= 0) {
    throw std::invalid_argument("mean_nees_bounds: dof and runs must be positive");
  }
  if (!(confidence > 0. && confidence < 1.)) {
    throw std::invalid_argument("mean_nees_bounds: confidence must be in (0, 1)");
  }
  // The sum of independent chi-square variables is chi-square, degrees of freedom added.
  const double sum_dof = static_cast<double>(dof) * runs;
  const double tail = 0.5 * (1. - confidence);
  return {chi2_quantile(tail, sum_dof) / runs, chi2_quantile(1. - tail, sum_dof) / runs};
}

}  // namespace viwo::eval
