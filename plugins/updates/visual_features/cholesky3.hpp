// Cholesky factor of the 3 x 3 matrix of a point.
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace viwo::visual {

/// A pivot below this part of the trace: the point is not determined within double precision.
inline constexpr double kSmallestPivot = 1e-12;

/// A = L L^T; false when a pivot is too small.
inline bool cholesky(const Eigen::Matrix3d& A, Eigen::Matrix3d& L) {
  const double limit = kSmallestPivot * A.trace();
  L.setZero();
  for (int j = 0; j < 3; ++j) {
    double pivot = A(j, j);
    for (int k = 0; k < j; ++k) pivot -= L(j, k) * L(j, k);
    if (!(pivot > limit)) return false;
    L(j, j) = std::sqrt(pivot);
    for (int i = j + 1; i < 3; ++i) {
      double sum = A(i, j);
      for (int k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
      L(i, j) = sum / L(j, j);
    }
  }
  return true;
}

}  // namespace viwo::visual
