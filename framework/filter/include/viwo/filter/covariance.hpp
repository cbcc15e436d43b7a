// The covariance of the error state and everything that changes it. All storage is allocated once.
// Equations: docs/math/filter.md.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/update.hpp"
#include "viwo/filter/held_directions.hpp"
#include "viwo/filter/propagation.hpp"

namespace viwo {

/// What came of a factor.
enum class FactorResult {
  kApplied,
  kWeakened,  ///< less likely than the factor's gate: applied with more noise
  kGated,     ///< less likely than the factor's gate
  kRejected,  ///< not finite, or its noise is not positive definite
  kFailed,    ///< the covariance is not positive definite any more
};

/// Whether the estimate has taken it in.
inline bool is_applied(FactorResult result) {
  return result == FactorResult::kApplied || result == FactorResult::kWeakened;
}

/// Errors of a pose, and maybe of its velocity, that become those of another estimate: that of the
/// orientation is turned, the others gain a part of what it was.
struct ErrorMove {
  int column = 0;  ///< of the orientation; position and velocity follow
  Eigen::Matrix3d turn;
  Eigen::Matrix3d position_by_theta;
  std::optional<Eigen::Matrix3d> velocity_by_theta = {};
};

class Covariance {
 public:
  /// `max_new`: most columns that are initialised at a time.
  explicit Covariance(int size, int max_new = 0);

  int size() const { return static_cast<int>(P_.rows()); }
  const Eigen::MatrixXd& matrix() const { return P_; }

  /// Sets the variances of consecutive columns; their covariances with everything become zero.
  void set_block(int first, const Eigen::MatrixXd& block);
  /// The same with no variance at all.
  void clear_block(int first, int count);
  /// P <- Phi P Phi^T + Q for the inertial state, Phi P for what it shares with the rest.
  void propagate(const ImuTransition& transition);
  /// P <- T P T^T, where T is the identity but for the errors that move (F-45).
  void move(std::span<const ErrorMove> moves);
  /// The pose at `column` becomes a copy of the inertial one.
  void clone_pose(int column);

  /// More covariance of three consecutive errors with three consecutive ones.
  void add(int row, int column, const Eigen::Matrix3d& block) {
    P_.block<3, 3>(row, column) += block;
  }
  /// One column of the error becomes `kept` of what it was, and gains `variance`.
  void decay(int column, double kept, double variance);
  /// The errors of J's rows, from column `first` on, become J times those of `columns` (F-24).
  void rewrite(int first, const FactorColumns& columns, const Eigen::Ref<const Eigen::MatrixXd>& J);

  /// Kalman update (F-7), its noise scaled by what was found and, beyond a gate of heavy tails, by
  /// as much as it takes; tells the noise what it has seen. `dx` (of the whole error state) is the
  /// correction; it is zero unless the factor was applied.
  FactorResult apply(const ResidualFactor& factor, Eigen::VectorXd& dx);
  /// Update by normal equations (F-8). Columns without variance are left out.
  FactorResult apply(const InformationFactor& factor, Eigen::VectorXd& dx);
  /// The same, but for what it does to directions that are held.
  template <class Factor>
  FactorResult apply(const Factor& factor, HeldDirections& held, Eigen::VectorXd& dx) {
    FactorResult result{};
    held.keep(P_, dx, [&] { return is_applied(result = apply(factor, dx)); });
    return result;
  }
  /// Takes new columns, without variance so far, out of an information factor (F-22): what it tells
  /// about the others remains. False: it does not determine them. Columns without variance that are
  /// not new stay in it and are left out by apply().
  bool split(std::span<const int> new_columns, InformationFactor& factor);
  /// Whether the factor that was split has columns with variance: something to apply().
  bool ties_known_columns() const { return !known_.empty(); }
  /// After apply() of what split() has left: the new columns (F-23). `dx` is that of apply() and
  /// gains what the new columns are corrected by.
  void initialise(Eigen::VectorXd& dx);

 private:
  double gate(int rows, double probability);
  void collect_columns(const FactorColumns& columns);
  /// Lambda of an information factor into G_, eta into y_, P_cc with its order reversed into W_;
  /// the number of columns.
  Eigen::Index gather(const InformationFactor& factor);
  /// Back into the order of the state: G_, of m columns of a factor and of what is added to the
  /// others, and the correction in the first column of W_.
  void scatter(Eigen::Index m, Eigen::VectorXd& dx);

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
  std::vector<Run> runs_;  // order_ in pieces that are contiguous in P and in the factor
  Eigen::MatrixXd C_, T_, Y_, Z_, G_, W_;
  Eigen::VectorXd y_;
  // Delayed initialisation: new columns, those that they are tied to, and what ties them.
  std::vector<int> new_, known_, new_index_, known_index_;
  Eigen::MatrixXd N_, G_new_, P_new_;
  Eigen::VectorXd eta_new_;
  struct Gate {
    int rows;
    double probability;
    double threshold;
  };
  std::vector<Gate> gates_;
};

}  // namespace viwo
