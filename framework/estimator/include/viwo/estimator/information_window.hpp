// What the factors of the last few seconds tell about some parameters of the state, in units of
// what was known before. Equations: docs/math/filter.md.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "viwo/api/update.hpp"

namespace viwo {

/// Sums the information about consecutive columns of the error state over a ring of bins. Nothing
/// is allocated after construction.
class InformationWindow {
 public:
  /// Extrinsics, clock and intrinsics of a wheel set.
  static constexpr int kMaxParameters = kPoseSize + 1 + kMaxIntrinsics;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                               kMaxParameters, kMaxParameters>;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxParameters, 1>;

  /// `sigma`: of the prior, for each column from `first_column` on. Columns with sigma zero are
  /// held and left out: the others are the parameters. std::invalid_argument for more than
  /// kMaxParameters.
  InformationWindow(int first_column, const Eigen::VectorXd& sigma, std::size_t bins);

  /// Looks at a factor that is about to be applied to the covariance P (F-18); add() it if it was
  /// applied. False: it tells nothing about these columns.
  bool measure(const ResidualFactor& factor, const Eigen::MatrixXd& P);
  /// The same; of the columns of an information factor the others are taken as known.
  bool measure(const InformationFactor& factor);
  /// Adds what was measured last to the present bin.
  void add() { bins_[bin_] += measured_; }
  /// Begins the next bin; the oldest one is forgotten.
  void next_bin();

  /// Eigenvalues and directions of all bins together. `believed`: for each parameter, which part
  /// (0 to 1) of the information about it is to be counted.
  void decompose(const Vector& believed);
  /// Of the last decompose(): information about orthonormal directions (the columns, in units of
  /// sigma()), ascending.
  const Vector& information() const { return solver_.eigenvalues(); }
  const Matrix& directions() const { return solver_.eigenvectors(); }
  /// For each parameter the sigma that this information alone leaves of the prior sigma (F-19).
  double sigma_ratio(Eigen::Index parameter) const;

  /// Of the parameters: their columns of the error state, and prior sigmas.
  std::span<const int> columns() const { return columns_; }
  const Vector& sigma() const { return sigma_; }

 private:
  /// Which parameter a column of the error state is; -1: none.
  int parameter_of(int column) const {
    const int i = column - first_column_;
    return i >= 0 && i < static_cast<int>(parameter_of_.size())
               ? parameter_of_[static_cast<std::size_t>(i)]
               : -1;
  }

  int first_column_;
  std::vector<int> parameter_of_;  // by column - first_column_
  std::vector<int> columns_;
  Vector sigma_;
  std::vector<Matrix> bins_;
  std::size_t bin_ = 0;
  Matrix measured_;
  // Of the size of the widest vectors: sums have the same bits only where they begin alike.
  alignas(64) Eigen::SelfAdjointEigenSolver<Matrix> solver_;
};

}  // namespace viwo
