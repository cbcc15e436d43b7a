// Twist solver: from the constraint rows of one encoder sample to the body twist, its
// sensitivities, its covariance and the parity residual. Equations: docs/math/wheel_odometry.md.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "viwo/wheel/wheel_model.hpp"

namespace viwo {

/// Sensitivity of a 3-vector by the intrinsics, one contiguous row per component.
using IntrinsicJacobian =
    Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor, 3, kMaxIntrinsics>;
using IntrinsicMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                                      kMaxIntrinsics, kMaxIntrinsics>;

struct TwistOptions {
  /// Rows weighted by the inverse of their noise instead of equally. Twist and parity noise are
  /// then independent.
  bool noise_weighted = false;
  /// Smallest ratio of the singular values of A (yaw rate scaled to the size of the velocities)
  /// that counts as full rank. For rolling rows it is about the spread of the wheel directions in rad; below it the
  /// velocity that the rows cannot tell is taken as zero.
  double rank_tolerance = 0.01;
  /// Standard deviation of what the rows cannot tell, per unit of the scaled twist [m/s].
  double unobserved_sigma_m_per_s = 0.1;
};

/// What the solver finds for one sample.
struct TwistSolution {
  Twist xi = Twist::Zero();
  RowVector e;                ///< parity residual b - A xi, m/s
  IntrinsicJacobian J_xi_WI;  ///< 3 x n: d xi / d x_WI
  Eigen::Matrix3d P_xi;       ///< covariance of xi from the row noise, per sample
  bool rank_deficient = false;
};

/// Information about x_WI from parity residuals: cost(d) = chi2 + 2 eta^T d + d^T Lambda d for a
/// change d of the intrinsics, to first order (W-10).
struct ParityInformation {
  IntrinsicMatrix Lambda;  ///< n x n: sum H^T R^-1 H
  Intrinsics eta;          ///< n: sum H^T R^-1 e
  double chi2 = 0.;        ///< sum e^T R^-1 e
  int dof = 0;

  void reset(int n);
};

/// Solves sample by sample. Holds scratch memory: one object per thread. No allocation after
/// construction.
class TwistSolver {
 public:
  TwistSolver(std::shared_ptr<const WheelModel> model, const TwistOptions& options);

  const WheelModel& model() const { return *model_; }
  const TwistOptions& options() const { return options_; }
  const Intrinsics& intrinsics() const { return x_WI_; }

  /// Linearisation point of all that follows. Throws InputError when it makes a model with constant
  /// A lose rank for good (all wheels at one place).
  void set_intrinsics(const Intrinsics& x_WI);

  /// Twist, residual, sensitivity and covariance. kRejected: the model refuses the sample or the
  /// result is not finite.
  Status solve(const EncoderSample& y, TwistSolution& out);

  /// For the sample last solved: whitened squared parity residual (chi-square with n_rows - 3
  /// degrees of freedom for white noise of the stated size), and what add_parity() needs.
  double parity_chi2();
  int parity_dof() const { return model_->n_rows() - parity_rank_; }

  /// Adds `weight` times the sample last solved (after parity_chi2()). The Jacobian is that at the
  /// fitted signal (W-9).
  void add_parity(double weight, ParityInformation& out);

 private:
  /// Maps from rows to the twist: plain or weighted least squares.
  struct Gain {
    Eigen::Matrix3d M_inv;      // (A^T W A)^-1, or its pseudo-inverse
    Eigen::Matrix3d P_missing;  // covariance of what a rank-deficient sample cannot tell
    Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxRows> A_plus;
    int rank = 3;
  };

  void solve_plain();
  void solve_weighted();
  void factor(const Eigen::Matrix3d& M, Gain& gain) const;
  void row_weights();

  std::shared_ptr<const WheelModel> model_;
  TwistOptions options_;
  Intrinsics x_WI_;
  bool A_is_current_ = false;  // A in rows_ and plain_ are those of x_WI_, for any sample

  EncoderSample y_;
  Twist xi_;
  RowSystem rows_;
  RowVector e_;
  Gain plain_, weighted_;
  IntrinsicDerivatives by_x_;
  NoiseDerivatives by_n_;
  NoiseVector variance_;
  // Row noise covariance and its inverse, block by block (block b at column b * size).
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRows, kMaxRows> R_, W_;

  // Fitted solution for the parity residual.
  Twist xi_w_;
  RowVector e_w_, b_fit_;
  Eigen::Matrix3d M_w_;
  int parity_rank_ = 3;
  IntrinsicDerivatives by_x_fit_;
  RowJacobian WJ_;
  struct BlockColumn {
    int column, first, count;  // first: row inside the block
  };
  std::vector<std::vector<BlockColumn>> block_columns_;
};

}  // namespace viwo
