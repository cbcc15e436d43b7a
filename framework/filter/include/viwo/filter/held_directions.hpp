// Directions of the error state that updates leave alone: they get no correction and keep their
// variance, and everything else is updated knowing how uncertain they are (a Schmidt-Kalman
// update). Equations: docs/math/filter.md.
#pragma once

#include <span>

#include <Eigen/Core>

namespace viwo {

/// Orthonormal directions N of the columns `first` .. `first + count - 1` in units of the sigmas D.
/// All storage is allocated once.
class HeldDirections {
 public:
  HeldDirections() = default;
  HeldDirections(int first, int count);

  int first() const { return first_; }
  int count() const { return count_; }
  /// How many directions are held.
  int size() const { return n_; }
  void clear() { n_ = 0; }

  /// Holds one more direction: `unit` of the `columns` in units of `sigma` (positive). Directions
  /// must be orthonormal. std::out_of_range for other columns.
  void add(std::span<const int> columns, const Eigen::Ref<const Eigen::VectorXd>& unit,
           const Eigen::Ref<const Eigen::VectorXd>& sigma);

  /// `apply` makes an update with the covariance P and says whether that was applied; then what it
  /// did to the directions is taken from its correction and from the covariance (F-20).
  template <class Apply>
  void keep(Eigen::MatrixXd& P, Eigen::VectorXd& dx, Apply&& apply) {
    remember(P);
    if (apply()) restore(dx, P);
  }

 private:
  void remember(const Eigen::MatrixXd& P);
  void restore(Eigen::VectorXd& dx, Eigen::Ref<Eigen::MatrixXd> P);

  int first_ = 0;
  int count_ = 0;
  int n_ = 0;
  Eigen::MatrixXd DN_;      // D N
  Eigen::MatrixXd Dinv_N_;  // D^-1 N
  Eigen::MatrixXd G_, half_, small_;
  Eigen::VectorXd along_;
};

}  // namespace viwo
