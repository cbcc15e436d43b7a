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

/// What moving all poses together changes in the rows of a factor: what is left of sums whose terms
/// are large is rounding, and so is all of a row that others have made zero.
class Shift {
 public:
  /// A row of a Jacobian, or of normal equations, by the columns of a factor; in units of its
  /// noise.
  template <class Row>
  void add(const Row& row, double scale, const FactorColumns& columns,
           std::span<const CloneState> clones) {
    Eigen::Array3d sum = Eigen::Array3d::Zero();
    int at = 0;
    for (const ColumnRange& block : columns.blocks()) {
      for (int i = 0; i < block.count; ++i, ++at) {
        const int axis = axis_of(block.first + i, clones);
        if (axis < 0) continue;
        sum[axis] += scale * row(at);
        largest_ = std::max(largest_, std::abs(scale * row(at)));
      }
    }
    most_ = std::max(most_, sum.abs().maxCoeff());
  }
  /// `least`: below it nothing is told, wherever all of it is.
  bool is_seen(double least) const { return most_ > std::max(kRounding * largest_, least); }

 private:
  double most_ = 0., largest_ = 0.;
};

/// Of a place that is told to no more than a kilometre nobody knows the digits that are lost.
constexpr double kLeastInformation = 1e-6;  // 1/m^2

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
  Shift shift;
  for (Eigen::Index i = 0; i < factor.H.rows(); ++i) {
    const double noise = factor.R(i, i) > 0. ? std::sqrt(factor.R(i, i)) : 1.;
    shift.add(factor.H.row(i), 1. / noise, factor.columns, clones);
  }
  return shift.is_seen(std::sqrt(kLeastInformation));
}

bool SharedPosition::is_seen_by(const InformationFactor& factor,
                                std::span<const CloneState> clones) const {
  Shift shift;
  const int n = factor.columns.size();
  for (int i = 0; i < n; ++i) {
    // Only the lower triangle is filled.
    const auto row = [&](int j) { return factor.Lambda(std::max(i, j), std::min(i, j)); };
    shift.add(row, 1., factor.columns, clones);
  }
  return shift.is_seen(kLeastInformation);
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
