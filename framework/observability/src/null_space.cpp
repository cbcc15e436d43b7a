#include "viwo/observability/null_space.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace viwo {
namespace {

/// Columns shorter than this part of the longest one are rounding.
constexpr double kZeroColumn = 1e-10;

/// What of `a` lies outside of `b`: its singular values are the sines of the angles, which tell
/// small ones better than the cosines.
Eigen::MatrixXd outside(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a - b * (b.transpose() * a);
}

/// Of A = U diag(values) V^T, with as many values as A has columns, the largest first.
struct Svd {
  Eigen::VectorXd values;
  Eigen::MatrixXd U, V;
};

/// JacobiSVD makes matrices square by a QR decomposition of its own, which it destroys twice where
/// memory ends meanwhile (Eigen 3.4): here it is given square ones.
Svd svd_of(const Eigen::MatrixXd& A) {
  const auto n = A.cols(), rows = A.rows();
  Eigen::MatrixXd tall = Eigen::MatrixXd::Zero(std::max(n, rows), n);
  tall.topRows(rows) = A;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(tall);
  const Eigen::MatrixXd R = qr.matrixQR().topRows(n).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<Eigen::MatrixXd, Eigen::NoQRPreconditioner> svd(
      R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Svd out{svd.singularValues(), Eigen::MatrixXd::Zero(tall.rows(), n), {}};
  if (rows < n) out.values.tail(n - rows).setZero();
  out.U.topRows(n) = svd.matrixU();
  out.U.applyOnTheLeft(qr.householderQ());
  out.U.conservativeResize(rows, n);
  out.V = qr.colsPermutation() * svd.matrixV();
  return out;
}

double gap_at(const Eigen::VectorXd& values, Eigen::Index rank) {
  if (rank == 0 || rank == values.size() || values[rank] == 0.) {
    return std::numeric_limits<double>::infinity();
  }
  return values[rank - 1] / values[rank];
}

/// How many values are above `threshold`; or, of cuts that are near it, one that is much clearer.
int rank_of(const Eigen::VectorXd& values, double threshold) {
  constexpr double kNear = 100., kMuch = 100.;
  const Eigen::Index n = values.size();
  Eigen::Index rank = 0;
  while (rank < n && values[rank] > threshold) ++rank;
  if (rank == 0) return 0;
  Eigen::Index best = rank;
  for (Eigen::Index k = 1; k < n; ++k) {
    const bool is_near = values[k - 1] * kNear > threshold && values[k] < kNear * threshold;
    if (is_near && gap_at(values, k) > kMuch * gap_at(values, best)) best = k;
  }
  return static_cast<int>(best);
}

}  // namespace

NullSpace null_space(const Eigen::MatrixXd& M, double tolerance) {
  if (M.cols() == 0 || !M.allFinite()) {
    throw std::invalid_argument("null_space() needs a finite matrix with columns");
  }
  const auto n = M.cols();
  NullSpace out;
  Eigen::VectorXd length = M.colwise().norm();
  const double longest = length.maxCoeff();
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!(length[i] > kZeroColumn * longest)) length[i] = std::numeric_limits<double>::infinity();
  }
  const Eigen::MatrixXd scaled = M * length.cwiseInverse().asDiagonal();
  const Svd svd = svd_of(scaled);
  out.singular_values = svd.values;
  const double threshold = tolerance * out.singular_values[0];
  out.rank = rank_of(out.singular_values, threshold);
  out.gap = gap_at(out.singular_values, out.rank);
  // Back to the columns as they were. Zero columns are in the null space by themselves.
  Eigen::MatrixXd basis = svd.V.rightCols(n - out.rank);
  for (Eigen::Index i = 0; i < n; ++i) {
    if (std::isfinite(length[i])) basis.row(i) /= length[i] / longest;
  }
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(basis);
  out.basis = qr.householderQ() * Eigen::MatrixXd::Identity(n, n - out.rank);
  return out;
}

double largest_angle(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  if (a.cols() == 0) return 0.;
  return std::asin(std::min(svd_of(outside(a, b)).values[0], 1.));
}

Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& A, double tolerance) {
  if (A.cols() == 0) return A;
  const Eigen::MatrixXd unit = A.colwise().normalized();
  const Svd svd = svd_of(unit);
  Eigen::Index rank = 0;
  while (rank < svd.values.size() && svd.values[rank] > tolerance) ++rank;
  return svd.U.leftCols(rank);
}

Eigen::MatrixXd intersection(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, double angle_rad) {
  if (a.cols() == 0 || b.cols() == 0) return Eigen::MatrixXd(a.rows(), 0);
  const Svd svd = svd_of(outside(a, b));
  Eigen::Index kept = 0;
  const auto n = a.cols();
  const double limit = std::sin(angle_rad);
  while (kept < n && !(svd.values[n - 1 - kept] > limit)) ++kept;
  return a * svd.V.rightCols(kept);
}

Eigen::MatrixXd readable(const Eigen::MatrixXd& a) {
  if (a.cols() == 0) return a;
  // Reduced row echelon form of a^T with complete pivoting.
  Eigen::MatrixXd rows = a.transpose();
  Eigen::Index done = 0;
  std::vector<bool> used(static_cast<std::size_t>(rows.cols()), false);
  for (; done < rows.rows(); ++done) {
    Eigen::Index row = done, col = 0;
    double best = 0.;
    for (Eigen::Index i = done; i < rows.rows(); ++i) {
      for (Eigen::Index k = 0; k < rows.cols(); ++k) {
        if (used[static_cast<std::size_t>(k)] || std::abs(rows(i, k)) <= best) continue;
        best = std::abs(rows(i, k));
        row = i;
        col = k;
      }
    }
    if (!(best > 0.)) break;
    used[static_cast<std::size_t>(col)] = true;
    rows.row(done).swap(rows.row(row));
    rows.row(done) /= rows(done, col);
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
      if (i != done) rows.row(i) -= rows(i, col) * rows.row(done);
    }
  }
  Eigen::MatrixXd out = rows.topRows(done).transpose();
  for (Eigen::Index i = 0; i < out.cols(); ++i) {
    Eigen::Index largest = 0;
    out.col(i).cwiseAbs().maxCoeff(&largest);
    out.col(i) /= out(largest, i);
  }
  return out;
}

}  // namespace viwo
