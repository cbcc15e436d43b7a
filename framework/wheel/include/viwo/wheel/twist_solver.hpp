// Twist solver: from the constraint rows of one encoder sample to the body twist, its
// sensitivities, its covariance and the parity residual. Equations: docs/math/wheel_odometry.md.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "viwo/wheel/wheel_model.hpp"

namespace viwo {

/// Sensitivity of a 3-vector by the intrinsics, one contiguous row per component.
using IntrinsicJacobian =
    Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor, 3, kMaxIntrinsics>;

struct TwistOptions {
  /// Rows weighted by the inverse of their noise instead of equally. Twist and parity noise are
  /// then independent.
  bool noise_weighted = false;
  /// Sensitivities of the twist at the signal that the twist itself predicts, as those of the
  /// parity residual always are (W-9): what the measured residual would add is noise for a filter
  /// that sums up thousands of samples, and counted as information about directions that the twist
  /// cannot show.
  bool fitted_jacobian = false;
  /// A twist whose components are all within so many of their own sigmas counts as rest in the
  /// sensitivities at the fitted signal (W-16). 0: all that is measured is motion.
  double motion_sigmas = 0.;
  /// Smallest ratio of the singular values of A (yaw rate scaled to the size of the velocities)
  /// that counts as full rank. For rolling rows it is about the spread of the wheel directions in
  /// rad; below it the velocity that the rows cannot tell is taken as zero.
  double rank_tolerance = 0.01;
  /// Standard deviation of what the rows cannot tell, per unit of the scaled twist [m/s].
  double unobserved_sigma_m_per_s = 0.1;
};

/// Whether a measured component of a motion may be none (W-16).
inline bool is_noise(double value, double variance, double motion_sigmas) {
  return value * value <= motion_sigmas * motion_sigmas * variance;
}

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
  IntrinsicMatrix Lambda;    ///< n x n: sum H^T R^-1 H
  Intrinsics eta;            ///< n: sum H^T R^-1 e
  IntrinsicMatrix of_noise;  ///< n x n: what the noise of the twists adds to Lambda (W-17)
  double chi2 = 0.;          ///< sum e^T R^-1 e
  double dof = 0.;           ///< what chi2 is to be expected to be: of cut samples there are parts

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

  /// Linearisation point of all that follows, and where the noise of the rows is taken, of which
  /// their weights are the inverse; the nominal intrinsics until told otherwise.
  void set_intrinsics(const Intrinsics& x_WI);

  /// The linearisation point alone: for derivatives, and for a fit. What changes by the weights is
  /// not what the rows say.
  void move_intrinsics(const Intrinsics& x_WI);

  /// Whether the base moves for sure in the samples that follow (W-16), although a sample alone may
  /// not show it.
  void set_moving(bool moves) { moves_ = moves; }

  /// Twist, residual, sensitivity and covariance. kRejected: the model refuses the sample, no
  /// drive is left of it, or the result is not finite. Channels that `y` calls bad are left out,
  /// with all rows that their noise enters. Keeps a reference to `y` for the calls about the sample
  /// last solved.
  Status solve(const EncoderSample& y, TwistSolution& out);

  class Parity;
  /// Of the sample last solved.
  Parity parity();
  /// Adds `weight` times the parity of the sample last solved. The Jacobian is that at the fitted
  /// signal (W-9).
  void add_parity(const Parity& parity, double weight, ParityInformation& out);
  /// Adds what the noise of its twist is expected to have in its information.
  void add_parity_of_noise(const Parity& parity, ParityInformation& out);

 private:
  // What has three entries gets a fourth lane, so that it is one register; the lane holds zero or
  // what is said. Everything below is sized at run time within compile-time bounds.
  using Lanes = Eigen::Vector4d;
  using RowLanes = Eigen::Matrix<double, 4, Eigen::Dynamic, Eigen::ColMajor, 4, kMaxRows>;

  /// Least squares of the rows (W-2), W = I or the inverse of the row noise.
  struct Fit {
    RowLanes WA;                        // column i: row i of W A; with noise weights W b below
    Eigen::Matrix<double, 4, 3> M_inv;  // (A^T W A)^-1, or its pseudo-inverse (W-3)
    Eigen::Matrix3d missing;            // sum of n n^T over the directions that A cannot tell
    int rank = 3;
    Twist xi;
    RowVector b, e;  // A xi, and what it leaves of the measured b

    void resize(int n_rows);
  };

  /// With noise weights, of directions that A cannot tell at all.
  static constexpr double kWeightedRankTolerance = 1e-6;

  bool moves(const Twist& xi, const Eigen::Matrix3d& P) const;
  void differentiate_fitted(const Twist& xi, const RowVector& e);
  void find_left_out(const EncoderSample& y);
  template <class Rows>
  void clear_left_out(Rows& rows) const;
  void fit_plain();
  Twist weight_twist() const;
  double fit_weighted(double rank_tolerance, Fit& fit);
  template <int kSize>
  Eigen::Matrix3d weigh_rows(RowLanes& WA);
  void factor(const Eigen::Matrix3d& M, double rank_tolerance, Fit& fit) const;
  void solve(Fit& fit) const;
  Twist least_squares(const Fit& fit, const RowVector& b) const;
  void set_residual(Fit& fit) const;
  void set_gain(const Fit& fit);
  template <int kSize>
  void twist_jacobian(const Fit& fit, IntrinsicJacobian& J_xi_WI) const;
  template <int kSize>
  void twist_covariance(const Fit& fit, Eigen::Matrix3d& P_xi) const;
  template <int kSize>
  void weigh_jacobian();
  template <int kSize>
  void add_information(const Fit& fit, double weight, IntrinsicMatrix& Lambda,
                       Intrinsics& eta) const;

  /// kSize if that is known, else what the model says.
  template <int kSize>
  int block_size() const {
    return kSize == Eigen::Dynamic ? model_->description().noise_block : kSize;
  }
  /// Row i of A, and b in the fourth lane.
  Lanes row(int i) const { return {rows_.A(i, 0), rows_.A(i, 1), rows_.A(i, 2), rows_.b[i]}; }
  /// Sum of map.col(i) J[i] over whole blocks of rows.
  template <int kSize>
  Lanes sum_rows(const RowLanes& map, const double* J, RowRange rows) const {
    const int size = block_size<kSize>();
    Lanes sum = Lanes::Zero();
    for (int i0 = rows.first; i0 < rows.first + rows.count; i0 += size) {
      for (int i = i0; i < i0 + size; ++i) sum += J[i] * map.col(i);
    }
    return sum;
  }

  std::shared_ptr<const WheelModel> model_;
  TwistOptions options_;
  std::vector<RowRange> intrinsic_rows_, noise_rows_;  // widened to whole noise blocks
  std::vector<std::vector<int>> block_noises_;         // sources that enter each noise block
  NoiseVector variance_;
  Intrinsics x_WI_;
  bool A_is_current_ = false;  // A in rows_, and the gain of the plain fit, are those of x_WI_

  Intrinsics weights_at_;
  bool weight_A_is_current_ = false;  // A in weight_rows_ is that of weights_at_

  bool moves_ = false;
  std::array<bool, kMaxRows> left_out_{};  // rows of the sample at hand
  int n_left_out_ = 0;
  bool is_undriven_ = false;  ///< no drive of it is believed

  const EncoderSample* y_ = nullptr;
  RowSystem rows_, weight_rows_;
  Fit plain_, weighted_;
  RowLanes A_plus_;                              // column i: what row i gives to the twist
  Eigen::Matrix<double, kMaxRows, kMaxRows> W_;  // block by block: rows i.. begin at (0, i)
  RowVector We_;                                 // of the weighted fit
  RowVector no_residual_;                        // zero
  double weighted_chi2_ = 0.;
  IntrinsicDerivatives by_x_;
  NoiseDerivatives by_n_;
  // W J of the parity residual; only what the noise blocks of a column touch is ever written.
  Eigen::Matrix<double, kMaxRows, kMaxIntrinsics, Eigen::RowMajor> WJ_;
};

/// What the rows of a sample leave when their weighted fit is taken out.
class TwistSolver::Parity {
 public:
  /// Whitened squared residual: chi-square with dof() degrees of freedom for white noise of the
  /// stated size.
  double chi2() const { return chi2_; }
  int dof() const { return dof_; }

 private:
  friend class TwistSolver;
  Fit fit_;
  double chi2_ = 0.;
  int dof_ = 0;
};

}  // namespace viwo
