// Inverse of the normal matrix A^T W A of a twist fit, as far as its rank goes.
#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace viwo {

struct NormalInverse {
  Eigen::Matrix3d inverse;  // (pseudo-)inverse of M
  Eigen::Matrix3d missing;  // sum of n n^T over the directions left out, in units of xi
  int rank = 3;
};

/// The pseudo-inverse of (W-3): velocities are scaled alike, the yaw rate to the same size.
inline NormalInverse pseudo_invert(const Eigen::Matrix3d& M, double tolerance) {
  const double velocity = std::sqrt(2. / (M(0, 0) + M(1, 1)));
  const Eigen::Vector3d scale(velocity, velocity, M(2, 2) > 0. ? 1. / std::sqrt(M(2, 2)) : 1.);
  const Eigen::Matrix3d Ms = scale.asDiagonal() * M * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(Ms);
  const double smallest = tolerance * tolerance * eigen.eigenvalues()[2];
  NormalInverse result{Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero(), 0};
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d n = eigen.eigenvectors().col(i);
    if (eigen.eigenvalues()[i] > smallest) {
      result.inverse += n * n.transpose() / eigen.eigenvalues()[i];
      ++result.rank;
    } else {
      result.missing += n * n.transpose();
    }
  }
  result.inverse = (scale.asDiagonal() * result.inverse * scale.asDiagonal()).eval();
  const Eigen::Vector3d unit = scale / velocity;  // in units of xi per m/s of the rows
  result.missing = (unit.asDiagonal() * result.missing * unit.asDiagonal()).eval();
  return result;
}

/// Inverse of M = A^T W A where its columns are independent to `tolerance`, otherwise the
/// pseudo-inverse.
inline NormalInverse invert_normal_matrix(const Eigen::Matrix3d& M, double tolerance) {
  // Scaled as in (W-3), M has trace 3, so the product of its two larger eigenvalues is at most 9/4
  // and det/(9/4) is a lower bound of the smallest: mostly enough, without an eigenvalue solver.
  const double half_trace = 0.5 * (M(0, 0) + M(1, 1));
  const double per_scaled = half_trace * half_trace * M(2, 2);  // det M / det of the scaled M
  NormalInverse result;
  double determinant = 0.;
  bool invertible = false;
  M.computeInverseAndDetWithCheck(result.inverse, determinant, invertible,
                                  6.75 * tolerance * tolerance * per_scaled);
  if (!invertible) return pseudo_invert(M, tolerance);
  result.missing.setZero();
  return result;
}

}  // namespace viwo
