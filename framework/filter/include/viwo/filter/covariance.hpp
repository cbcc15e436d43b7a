// The covariance of the error state and everything that changes it. All storage is allocated once.
// Equations: docs/math/filter.md.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/update.hpp"
#include "viwo/filter/held_directions.hpp"
#include "viwo/filter/propagation.hpp"

namespace viwo {

/// What came of a factor.
enum class FactorResult {
  kApplied,
  kGated,     ///< less likely than the factor's gate
  kRejected,  ///< not finite, or its noise is not positive definite
  kFailed,    ///< the covariance is not positive definite any more
};

class Covariance {
 public:
  explicit Covariance(int size);

  int size() const { return static_cast<int>(P_.rows()); }
  const Eigen::MatrixXd& matrix() const { return P_; }

  /// Sets the variances of consecutive columns; their covariances with everything become zero.
  void set_block(int first, const Eigen::MatrixXd& block);
  /// The same with no variance at all.
  void clear_block(int first, int count);
  /// P <- Phi P Phi^T + Q for the inertial state, Phi P for what it shares with the rest.
  void propagate(const ImuTransition& transition);
  /// The pose at `column` becomes a copy of the inertial one.
  void clone_pose(int column);

  /// Kalman update (F-7). `dx` (of the whole error state) is the correction; it is zero unless the
  /// factor was applied.
  FactorResult apply(const ResidualFactor& factor, Eigen::VectorXd& dx);
  /// Update by normal equations (F-8). Columns without variance are left out.
  FactorResult apply(const InformationFactor& factor, Eigen::VectorXd& dx);
  /// Takes from what apply() did what it did to the directions; held.before() came before it.
  void hold(HeldDirections& held, Eigen::VectorXd& dx) { held.after(dx, P_); }

 private:
  double gate(int rows, double probability);
  void collect_columns(const FactorColumns& columns);

  Eigen::MatrixXd P_;
  Eigen::MatrixXd PHt_;  // n x rows
  // Information updates: the columns of the factor first, then the others.
  std::vector<int> order_;         // columns of P in this order
  std::vector<int> factor_index_;  // of the first of them, in the factor
  std::vector<bool> in_factor_;
  struct Run {
    int start;   ///< in order_
    int column;  ///< in P
    int count;
  };
  std::vector<Run> runs_;  // order_ in pieces that are contiguous in both
  Eigen::MatrixXd C_, T_, Y_, Z_, G_, W_;
  Eigen::VectorXd y_;
  struct Gate {
    int rows;
    double probability;
    double threshold;
  };
  std::vector<Gate> gates_;
};

}  // namespace viwo
