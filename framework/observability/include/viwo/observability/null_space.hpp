// Rank and null space of an observability matrix, and how a direction lies to them.
#pragma once

#include <Eigen/Core>

namespace viwo {

/// Of a matrix whose columns were first scaled to unit length (zero columns stay).
struct NullSpace {
  int rank = 0;
  Eigen::VectorXd singular_values;  ///< descending, of the scaled matrix
  /// Orthonormal basis of the null space in the units of the unscaled columns: n x (n - rank).
  Eigen::MatrixXd basis;
  /// Smallest singular value kept over the largest one dropped: how clear the cut is. Infinite
  /// when nothing is dropped or what is dropped is zero.
  double gap = 0.;
};

/// Singular values at most `tolerance` times the largest one count as zero; where the cut within a
/// factor of 100 of that is 100 times clearer, those beyond it do. So do columns shorter than 1e-10
/// times the longest one: give them in comparable units. std::invalid_argument for a matrix that is
/// not finite or without columns.
NullSpace null_space(const Eigen::MatrixXd& M, double tolerance);

/// Largest principal angle between span(a) and span(b), rad: 0 when all of `a` is in `b`; `a` and
/// `b` are orthonormal.
double largest_angle(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// Orthonormal basis of the columns of `A`; columns that depend on others are left out.
Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& A, double tolerance = 1e-9);

/// The part of span(a) that lies in span(b) within `angle_rad`: orthonormal, possibly empty.
Eigen::MatrixXd intersection(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, double angle_rad);

/// Basis of span(a) with as many zeros as elimination gives: columns whose largest entry is 1.
Eigen::MatrixXd readable(const Eigen::MatrixXd& a);

}  // namespace viwo
