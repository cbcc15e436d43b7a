#include "viwo/filter/held_directions.hpp"

#include <stdexcept>

namespace viwo {

using Eigen::Index;

HeldDirections::HeldDirections(int first, int count)
    : first_(first),
      count_(count),
      DN_(count, count),
      Dinv_N_(count, count),
      G_(count, count),
      half_(count, count),
      small_(count, count),
      along_(count) {}

void HeldDirections::add(std::span<const int> columns,
                         const Eigen::Ref<const Eigen::VectorXd>& unit,
                         const Eigen::Ref<const Eigen::VectorXd>& sigma) {
  if (n_ == count_) throw std::out_of_range("no more directions can be held");
  DN_.col(n_).setZero();
  Dinv_N_.col(n_).setZero();
  Index i = 0;
  for (const int column : columns) {
    const int row = column - first_;
    if (row < 0 || row >= count_) throw std::out_of_range("a column that cannot be held");
    DN_(row, n_) = unit[i] * sigma[i];
    Dinv_N_(row, n_) = unit[i] / sigma[i];
    ++i;
  }
  ++n_;
}

void HeldDirections::remember(const Eigen::MatrixXd& P) {
  if (n_ > 0) G_ = P.block(first_, first_, count_, count_);
}

void HeldDirections::restore(Eigen::VectorXd& dx, Eigen::Ref<Eigen::MatrixXd> P) {
  if (n_ == 0) return;
  const auto DN = DN_.leftCols(n_);
  const auto Dinv_N = Dinv_N_.leftCols(n_);
  auto along = along_.head(n_);
  along.noalias() = Dinv_N.transpose() * dx.segment(first_, count_);
  dx.segment(first_, count_).noalias() -= DN * along;
  // Q G Q^T = D N (N^T D^-1 G D^-1 N) N^T D.
  auto P_cc = P.block(first_, first_, count_, count_);
  G_ -= P_cc;
  auto half = half_.leftCols(n_);
  auto small = small_.topLeftCorner(n_, n_);
  half.noalias() = G_ * Dinv_N;
  small.noalias() = Dinv_N.transpose() * half;
  half.noalias() = DN * small;
  G_.noalias() = half * DN.transpose();
  // Symmetric to the last bit, as what it is added to.
  G_.triangularView<Eigen::StrictlyUpper>() = G_.transpose();
  P_cc += G_;
}

}  // namespace viwo
