#include "arrow_system.hpp"

#include <algorithm>

namespace viwo::smoother {
namespace {

/// Of 16 bytes each: then they are summed up.
constexpr std::size_t kMostTriplets = 4'000'000;

}  // namespace

ArrowSystem::ArrowSystem(int n_shared)
    : Lambda_(Eigen::MatrixXd::Zero(n_shared, n_shared)), eta_(Eigen::VectorXd::Zero(n_shared)) {}

void ArrowSystem::add(std::span<const int> columns, const Eigen::Ref<const Eigen::MatrixXd>& Lambda,
                      const Eigen::Ref<const Eigen::VectorXd>& eta) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const int row = columns[i];
    if (row == kHeld) continue;
    const auto li = static_cast<Eigen::Index>(i);
    if (row < 0) {
      eta_[~row] += eta[li];
    } else {
      n_own_ = std::max(n_own_, row + 1);
      eta_own_.resize(static_cast<std::size_t>(n_own_), 0.);
      eta_own_[static_cast<std::size_t>(row)] += eta[li];
    }
    for (std::size_t k = 0; k <= i; ++k) {
      const int column = columns[k];
      // What stands beside the diagonal of Lambda may come to stand on that of the system.
      const double times = k < i && row == column ? 2. : 1.;
      const double value = times * Lambda(li, static_cast<Eigen::Index>(k));
      if (column == kHeld || value == 0.) continue;
      if (row < 0 && column < 0) {
        Lambda_(~row, ~column) += value;
        if (row != column) Lambda_(~column, ~row) += value;
      } else if (row < 0) {
        across_.emplace_back(column, ~row, value);
      } else if (column < 0) {
        across_.emplace_back(row, ~column, value);
      } else {
        triplets_.emplace_back(std::max(row, column), std::min(row, column), value);
      }
    }
  }
  if (triplets_.size() > kMostTriplets) gather();
}

void ArrowSystem::gather() {
  Eigen::SparseMatrix<double> more(n_own_, n_own_);
  more.setFromTriplets(triplets_.begin(), triplets_.end());
  triplets_.clear();
  if (own_.size() == 0) {
    own_.swap(more);
    return;
  }
  own_.conservativeResize(n_own_, n_own_);
  own_ += more;
}

bool ArrowSystem::eliminate() {
  gather();
  llt_.compute(own_);
  if (llt_.info() != Eigen::Success) return false;
  Eigen::MatrixXd across = Eigen::MatrixXd::Zero(n_own_, Lambda_.cols());
  for (const auto& one : across_) across(one.row(), one.col()) += one.value();
  const Eigen::Map<const Eigen::VectorXd> eta(eta_own_.data(), n_own_);
  by_shared_ = llt_.solve(across);
  alone_ = llt_.solve(eta);
  Lambda_ -= across.transpose() * by_shared_;
  Lambda_ = (0.5 * (Lambda_ + Lambda_.transpose())).eval();
  eta_ -= across.transpose() * alone_;
  return alone_.allFinite() && Lambda_.allFinite();
}

Eigen::VectorXd ArrowSystem::own(const Eigen::VectorXd& dx_shared) const {
  return alone_ - by_shared_ * dx_shared;
}

}  // namespace viwo::smoother
