// Columns of the covariance that come while the filter runs: blocks that a factor determines, and
// blocks that are written anew. Equations: docs/math/filter.md.
#include <algorithm>

#include <Eigen/Cholesky>

#include "viwo/filter/covariance.hpp"

namespace viwo {
namespace {

using Eigen::Index;

/// Lambda(i, j), of which only the lower triangle is kept.
double& entry(InformationFactor& factor, int i, int j) {
  return factor.Lambda(std::max(i, j), std::min(i, j));
}

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Whether a Cholesky factor is that of a matrix which is singular but for rounding: what the
/// entries before it leave of one is less than this part of it.
bool is_singular(const Eigen::Ref<const Eigen::MatrixXd>& L) {
  constexpr double kLeastPart = 1e-12;
  for (Index i = 0; i < L.rows(); ++i) {
    if (!(L(i, i) * L(i, i) > kLeastPart * L.row(i).head(i + 1).squaredNorm())) return true;
  }
  return false;
}

}  // namespace

bool Covariance::split(std::span<const int> new_columns, InformationFactor& factor) {
  new_.clear();
  known_.clear();
  new_index_.clear();
  known_index_.clear();
  int index = 0;
  for (const ColumnRange& block : factor.columns.blocks()) {
    for (int column = block.first; column < block.first + block.count; ++column, ++index) {
      if (std::find(new_columns.begin(), new_columns.end(), column) != new_columns.end()) {
        new_.push_back(column);
        new_index_.push_back(index);
      } else if (P_(column, column) > 0.) {
        known_.push_back(column);
        known_index_.push_back(index);
      }
    }
  }
  const auto n = static_cast<Index>(new_.size());
  const auto m = static_cast<Index>(known_.size());
  if (new_.size() != new_columns.size()) return false;  // it does not even speak of all of them
  auto N = N_.topLeftCorner(n, n);
  auto G = G_new_.topLeftCorner(n, m);
  auto eta = eta_new_.head(n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) N(i, j) = entry(factor, new_index_[at(i)], new_index_[at(j)]);
    for (Index j = 0; j < m; ++j) G(i, j) = entry(factor, new_index_[at(i)], known_index_[at(j)]);
    eta[i] = factor.eta[new_index_[at(i)]];
  }
  if (!N.allFinite() || !G.allFinite() || !eta.allFinite()) return false;
  Eigen::Ref<Eigen::MatrixXd> N_ref(N);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(N_ref);
  if (llt.info() != Eigen::Success || is_singular(N)) return false;
  // (F-22), with G = L^-1 Lambda_nk and eta = L^-1 eta_n so far.
  N.triangularView<Eigen::Lower>().solveInPlace(G);
  N.triangularView<Eigen::Lower>().solveInPlace(eta);
  for (Index j = 0; j < m; ++j) {
    for (Index i = j; i < m; ++i) {
      entry(factor, known_index_[at(i)], known_index_[at(j)]) -= G.col(i).dot(G.col(j));
    }
    factor.eta[known_index_[at(j)]] -= G.col(j).dot(eta);
  }
  return true;
}

void Covariance::initialise(Eigen::VectorXd& dx) {
  const auto n = static_cast<Index>(new_.size());
  const auto m = static_cast<Index>(known_.size());
  const auto N = N_.topLeftCorner(n, n).triangularView<Eigen::Lower>();
  auto G = G_new_.topLeftCorner(n, m);
  auto eta = eta_new_.head(n);
  N.transpose().solveInPlace(G);
  N.transpose().solveInPlace(eta);
  // (F-23): columns of the new errors, then their own corner.
  auto P = P_new_.leftCols(n);
  P.setZero();
  for (Index j = 0; j < m; ++j) {
    const int column = known_[at(j)];
    for (Index i = 0; i < n; ++i) P.col(i) -= G(i, j) * P_.col(column);
    eta -= G.col(j) * dx[column];
  }
  for (Index i = 0; i < n; ++i) {
    P_.col(new_[at(i)]) = P.col(i);
    P_.row(new_[at(i)]) = P.col(i).transpose();
    dx[new_[at(i)]] = eta[i];
  }
  auto corner = W_.topLeftCorner(n, n);  // Lambda_nn^-1 so far
  corner.setIdentity();
  N.solveInPlace(corner);
  N.transpose().solveInPlace(corner);
  for (Index i = 0; i < n; ++i) {
    for (Index k = 0; k <= i; ++k) {
      double variance = corner(i, k);
      for (Index j = 0; j < m; ++j) variance -= P(known_[at(j)], i) * G(k, j);
      P_(new_[at(i)], new_[at(k)]) = P_(new_[at(k)], new_[at(i)]) = variance;
    }
  }
}

void Covariance::rewrite(int first, const FactorColumns& columns,
                         const Eigen::Ref<const Eigen::MatrixXd>& J) {
  const Index n = J.rows();
  auto P = P_new_.leftCols(n);
  P.setZero();
  Index start = 0;
  for (const ColumnRange& block : columns.blocks()) {
    P.noalias() += P_.middleCols(block.first, block.count)
                       .lazyProduct(J.middleCols(start, block.count).transpose());
    start += block.count;
  }
  Eigen::Matrix<double, kMaxRoomEntries, kMaxRoomEntries> corner;
  corner.setZero();
  start = 0;
  for (const ColumnRange& block : columns.blocks()) {
    corner.topLeftCorner(n, n) +=
        J.middleCols(start, block.count).lazyProduct(P.middleRows(block.first, block.count));
    start += block.count;
  }
  P_.middleCols(first, n) = P;
  P_.middleRows(first, n) = P.transpose();
  for (Index i = 0; i < n; ++i) {
    for (Index k = 0; k <= i; ++k) {
      P_(first + i, first + k) = P_(first + k, first + i) = corner(i, k);
    }
  }
}

}  // namespace viwo
