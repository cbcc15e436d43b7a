#include "viwo/eval/consistency.hpp"

#include <limits>
#include <stdexcept>

#include <Eigen/Cholesky>

#include "viwo/math/chi2.hpp"

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

double chi2_quantile(double p, double dof) {
  if (!(p >= 0. && p < 1.)) throw std::invalid_argument("chi2_quantile: p must be in [0, 1)");
  if (!(dof > 0.)) throw std::invalid_argument("chi2_quantile: dof must be positive");
  return viwo::chi2_quantile(p, dof);
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
