// Central differences, and a check that names the column that is wrong.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace viwo::testing {

/// d f / d x by central differences; `step` per entry of x.
inline Eigen::MatrixXd central_difference(
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f, const Eigen::VectorXd& x,
    double step = 1e-6) {
  Eigen::MatrixXd J;
  for (int k = 0; k < x.size(); ++k) {
    Eigen::VectorXd forward = x, backward = x;
    forward[k] += step;
    backward[k] -= step;
    const Eigen::VectorXd column = (f(forward) - f(backward)) / (2. * step);
    if (J.size() == 0) J.resize(column.size(), x.size());
    J.col(k) = column;
  }
  return J;
}

/// Empty if `analytic` agrees with `numeric` to `tolerance`, relative to the largest entry of the
/// column (at least 1e-3); otherwise names the columns that do not, with both.
inline std::string jacobian_mismatch(const Eigen::MatrixXd& analytic,
                                     const Eigen::MatrixXd& numeric,
                                     const std::vector<std::string>& columns,
                                     double tolerance = 1e-6) {
  std::ostringstream out;
  if (analytic.rows() != numeric.rows() || analytic.cols() != numeric.cols()) {
    out << "sizes differ: " << analytic.rows() << "x" << analytic.cols() << " and "
        << numeric.rows() << "x" << numeric.cols();
    return out.str();
  }
  for (int k = 0; k < analytic.cols(); ++k) {
    const double scale = std::max(numeric.col(k).cwiseAbs().maxCoeff(), 1e-3);
    const double worst = (analytic.col(k) - numeric.col(k)).cwiseAbs().maxCoeff();
    if (worst <= tolerance * scale) continue;  // false for NaN
    const auto index = static_cast<std::size_t>(k);
    out << "column " << k << (index < columns.size() ? " (" + columns[index] + ")" : "")
        << ": analytic [" << analytic.col(k).transpose() << "], central differences ["
        << numeric.col(k).transpose() << "]\n";
  }
  return out.str();
}

}  // namespace viwo::testing
