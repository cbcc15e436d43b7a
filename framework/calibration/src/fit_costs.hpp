// What the solver of a fit minimises: residuals of recordings, and a prior, of scaled unknowns.
#pragma once

#include <Eigen/Dense>
#include <ceres/cost_function.h>

#include "calibration_problem.hpp"
#include "viwo/calibration/calibrate.hpp"
#include "viwo/wheel/held_gauge.hpp"

namespace viwo::calibration {

/// Unknowns in units of their prior sigmas: u = (value - start) / sigma. Entries with sigma 0 are
/// held. Where the gauge holds some, what is known of the others hangs together (CAL-18).
struct Prior {
  Intrinsics x_WI, sigma;
  Intrinsics drawn_sigma;  ///< in the frame of the drawing, in which nothing is held
  PlanarExtrinsics extrinsics, extrinsics_sigma;
  Eigen::Vector2d own_sigma;  ///< of the clock offset and the gyro bias of each recording
  Eigen::MatrixXd root;       ///< of the correlations of the shared unknowns, lower triangle
  Eigen::MatrixXd whitening;  ///< its inverse

  Prior(const CalibrationRecording& first, const CalibrationOptions& options, const FitStart& start)
      : x_WI(start.x_WI),
        sigma(start.sigma),
        drawn_sigma(start.sigma),
        extrinsics(options.extrinsics_x_m_y_m_yaw_rad) {
    const bool poses = first.motion.kind == ReferenceKind::kPoses;
    const bool estimates = poses && options.estimate_extrinsics;
    const double m = estimates ? options.prior_sigma_extrinsics_m : 0.;
    const double rad = estimates ? options.prior_sigma_extrinsics_rad : 0.;
    extrinsics_sigma = {m, m, rad};
    root.setIdentity(n_shared(), n_shared());
    // Where O is the reference body nothing is left to a gauge.
    if (!poses || estimates) hold_gauge(*first.setup.model);
    whitening = root.triangularView<Eigen::Lower>().solve(
        Eigen::MatrixXd::Identity(root.rows(), root.cols()));
    const bool gyro = first.motion.kind == ReferenceKind::kGyro;
    const bool clock = first.motion.kind != ReferenceKind::kNone;
    own_sigma = {clock ? options.prior_sigma_clock_offset_s : 0.,
                 gyro ? options.prior_sigma_gyro_bias_rad_per_s : 0.};
  }

  int n_shared() const { return static_cast<int>(sigma.size()) + 3; }

  CalibrationPoint point(const double* shared, const double* own) const {
    CalibrationPoint at;
    const auto n = static_cast<int>(sigma.size());
    at.x_WI = x_WI + sigma.cwiseProduct(Eigen::Map<const Eigen::VectorXd>(shared, n));
    at.extrinsics =
        extrinsics + extrinsics_sigma.cwiseProduct(Eigen::Map<const Eigen::Vector3d>(shared + n));
    at.clock_offset_s = own_sigma[0] * own[0];
    at.gyro_bias_rad_per_s = own_sigma[1] * own[1];
    return at;
  }

  /// What is known of the shared unknowns before.
  Eigen::MatrixXd information() const { return whitening.transpose() * whitening; }

  /// Derivative by the scaled unknowns [shared, own].
  Eigen::VectorXd scale() const {
    Eigen::VectorXd all(n_shared() + 2);
    all << sigma, extrinsics_sigma, own_sigma;
    return all;
  }

 private:
  void hold_gauge(const WheelModel& model) {
    const Eigen::MatrixXd P =
        prior_in_held_frame(model, x_WI, sigma, known_of_body(extrinsics, extrinsics_sigma));
    const Eigen::VectorXd in_held = P.diagonal().cwiseSqrt();
    sigma = in_held.head(sigma.size());
    extrinsics_sigma = in_held.tail<3>();
    const Eigen::LLT<Eigen::MatrixXd> llt(correlation_matrix(P));
    if (llt.info() != Eigen::Success) {
      throw InputError(
          "the prior sigmas of the intrinsics are too unlike: one that is zero, but "
          "for rounding, holds nothing");
    }
    root = llt.matrixL();
  }
};

/// Residuals of one recording for the solver.
class RecordingCost final : public ceres::CostFunction {
 public:
  RecordingCost(RecordingProblem& problem, const Prior& prior) : problem_(problem), prior_(prior) {
    set_num_residuals(static_cast<int>(problem.kinds().size()));
    *mutable_parameter_block_sizes() = {prior.n_shared(), 2};
  }

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    RecordingResiduals at;
    problem_.evaluate(prior_.point(parameters[0], parameters[1]), jacobians != nullptr, at);
    Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) = at.r;
    if (jacobians == nullptr) return at.r.allFinite();
    const Eigen::MatrixXd J = at.J * prior_.scale().asDiagonal();
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const int n = prior_.n_shared();
    if (jacobians[0] != nullptr) Eigen::Map<RowMajor>(jacobians[0], J.rows(), n) = J.leftCols(n);
    if (jacobians[1] != nullptr) Eigen::Map<RowMajor>(jacobians[1], J.rows(), 2) = J.rightCols(2);
    return at.r.allFinite() && J.allFinite();
  }

 private:
  RecordingProblem& problem_;
  const Prior& prior_;
};

/// The prior of scaled unknowns: r = whitening u.
class PriorCost final : public ceres::CostFunction {
 public:
  explicit PriorCost(const Eigen::MatrixXd& whitening) : whitening_(whitening) {
    const auto size = static_cast<int>(whitening.rows());
    set_num_residuals(size);
    *mutable_parameter_block_sizes() = {size};
  }
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const int n = num_residuals();
    Eigen::Map<Eigen::VectorXd>(residuals, n) =
        whitening_ * Eigen::Map<const Eigen::VectorXd>(parameters[0], n);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      Eigen::Map<RowMajor>(jacobians[0], n, n) = whitening_;
    }
    return true;
  }

 private:
  Eigen::MatrixXd whitening_;
};

}  // namespace viwo::calibration
