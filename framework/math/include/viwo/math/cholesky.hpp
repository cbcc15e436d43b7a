// Cholesky's factorisation with what stands below the matrix taken along: the sizes of a filter
// (tens to a few hundred) as few products of matrices, without the heap.
#pragma once

#include <algorithm>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace viwo {

using MatrixRef = Eigen::Ref<Eigen::MatrixXd>;

/// Columns that are worked on at once: the few that fit into the first cache beside what they are
/// multiplied with.
inline constexpr Eigen::Index kPanel = 24;

/// Calls `work(first, count)` for one panel of columns after the other; stops when it returns
/// false, and returns that.
template <class Work>
bool for_panels(Eigen::Index columns, const Work& work) {
  for (Eigen::Index first = 0; first < columns; first += kPanel) {
    if (!work(first, std::min(kPanel, columns - first))) return false;
  }
  return true;
}

/// In place: the lower triangle of `A` (n x n, only that is read) becomes L with A = L L^T, `upper`
/// (upper triangular, n x n, or without rows) becomes upper L^-T, which is upper triangular, too,
/// and `rows` (any number x n) becomes rows L^-T. False when A is not positive definite; then all
/// three are in ruins.
inline bool cholesky(MatrixRef A, MatrixRef upper, MatrixRef rows) {
  const Eigen::Index n = A.cols();
  return for_panels(n, [&](Eigen::Index first, Eigen::Index count) {
    const Eigen::Index end = first + count;
    const auto done = A.block(first, 0, count, first);
    auto diagonal = A.block(first, first, count, count);
    auto below = A.block(end, first, n - end, count);
    auto above = upper.block(0, first, upper.rows() > 0 ? end : 0, count);
    auto beside = rows.middleCols(first, count);
    if (first > 0) {
      diagonal.noalias() -= done * done.transpose();
      below.noalias() -= A.bottomLeftCorner(n - end, first) * done.transpose();
      if (above.rows() > 0) {
        above.topRows(first).noalias() -= upper.topLeftCorner(first, first) * done.transpose();
      }
      beside.noalias() -= rows.leftCols(first) * done.transpose();
    }
    MatrixRef corner(diagonal);
    if (Eigen::LLT<MatrixRef>(corner).info() != Eigen::Success) return false;
    const auto L_transposed = corner.triangularView<Eigen::Lower>().transpose();
    const auto divide = [&](auto& block) {
      if (block.rows() > 0) L_transposed.template solveInPlace<Eigen::OnTheRight>(block);
    };
    divide(below);
    divide(above);
    divide(beside);
    return true;
  });
}

/// The lower triangle of `square` (and more) becomes U U^T; `U` is upper triangular, with zeros
/// below.
inline void square_of_upper(const Eigen::Ref<const Eigen::MatrixXd>& U, MatrixRef square) {
  const Eigen::Index n = U.cols();
  for_panels(n, [&](Eigen::Index first, Eigen::Index count) {
    const Eigen::Index rest = n - first;
    square.block(first, first, rest, count).noalias() =
        U.bottomRightCorner(rest, rest) * U.block(first, first, count, rest).transpose();
    return true;
  });
}

}  // namespace viwo
