#include "viwo/filter/shared_position.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

namespace viwo {
namespace {

/// Poses know each other to less than a millimetre: beside a variance of more than this that takes
/// more digits than a double has.
constexpr double kLargestVariance_m2 = 100.;
constexpr double kRounding = 1e-9;

/// x, y or z of the position of a pose; -1: another column.
int axis_of(int column, std::span<const CloneState> clones) {
  const auto within = [column](int first) {
    return column >= first && column < first + 3 ? column - first : -1;
  };
  int axis = within(kPositionColumn);
  for (const CloneState& clone : clones) axis = std::max(axis, within(clone.column + 3));
  return axis;
}

/// Whether moving all poses together changes what a row of a Jacobian, by the columns of a factor,
/// is of: more than rounding leaves of what was added up.
template <class Row>
bool is_seen_in(const Row& row, const FactorColumns& columns, std::span<const CloneState> clones) {
  Eigen::Array3d sum = Eigen::Array3d::Zero();
  double largest = 0.;
  int at = 0;
  for (const ColumnRange& block : columns.blocks()) {
    for (int i = 0; i < block.count; ++i, ++at) {
      const int axis = axis_of(block.first + i, clones);
      if (axis < 0) continue;
      sum[axis] += row(at);
      largest = std::max(largest, std::abs(row(at)));
    }
  }
  return sum.abs().maxCoeff() > kRounding * largest;
}

}  // namespace

void SharedPosition::take_from(Eigen::Ref<Eigen::Matrix3d> P_position) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(P_position);
  const Eigen::Vector3d beyond = (eigen.eigenvalues().array() - kLargestVariance_m2).cwiseMax(0.);
  P_.setZero();
  if (beyond.isZero(0.)) return;
  P_ = eigen.eigenvectors() * beyond.asDiagonal() * eigen.eigenvectors().transpose();
  P_position -= P_;
}

bool SharedPosition::is_seen_by(const ResidualFactor& factor,
                                std::span<const CloneState> clones) const {
  for (Eigen::Index i = 0; i < factor.H.rows(); ++i) {
    if (is_seen_in(factor.H.row(i), factor.columns, clones)) return true;
  }
  return false;
}

bool SharedPosition::is_seen_by(const InformationFactor& factor,
                                std::span<const CloneState> clones) const {
  const int n = factor.columns.size();
  for (int i = 0; i < n; ++i) {
    // Only the lower triangle is filled.
    const auto row = [&](int j) { return factor.Lambda(std::max(i, j), std::min(i, j)); };
    if (is_seen_in(row, factor.columns, clones)) return true;
  }
  return false;
}

void SharedPosition::return_to(Covariance& covariance, std::span<const CloneState> clones) {
  covariance.add(kPositionColumn, kPositionColumn, P_);
  for (const CloneState& a : clones) {
    covariance.add(a.column + 3, kPositionColumn, P_);
    covariance.add(kPositionColumn, a.column + 3, P_);
    for (const CloneState& b : clones) covariance.add(a.column + 3, b.column + 3, P_);
  }
  P_.setZero();
}

}  // namespace viwo
