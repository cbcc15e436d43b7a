// What the solver of a fit minimises: residuals of recordings, and a prior, of scaled unknowns.
#pragma once

#include <algorithm>

#include <Eigen/Dense>
#include <ceres/cost_function.h>

#include "calibration_problem.hpp"
#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {

/// Unknowns in units of their prior sigmas: u = (value - start) / sigma. Entries with sigma 0 are
/// held.
struct Prior {
  Intrinsics x_WI, sigma;
  PlanarExtrinsics extrinsics, extrinsics_sigma;
  Eigen::Vector2d own_sigma;  ///< of the clock offset and the gyro bias of each recording

  Prior(const CalibrationRecording& first, const CalibrationOptions& options, const FitStart& start)
      : x_WI(start.x_WI), sigma(start.sigma) {
    const bool poses = first.motion.kind == ReferenceKind::kPoses;
    const auto& specs = first.setup.model->description().intrinsics;
    for (int i = 0; i < sigma.size(); ++i) {
      // Where O is the reference body nothing is left to a gauge.
      const bool held = specs[static_cast<std::size_t>(i)].gauge_fixed;
      if (held && (!poses || options.estimate_extrinsics)) sigma[i] = 0.;
    }
    const bool estimates = poses && options.estimate_extrinsics;
    const double m = estimates ? options.prior_sigma_extrinsics_m : 0.;
    const double rad = estimates ? options.prior_sigma_extrinsics_rad : 0.;
    extrinsics = options.extrinsics_x_m_y_m_yaw_rad;
    extrinsics_sigma = {m, m, rad};
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

  /// Derivative by the scaled unknowns [shared, own].
  Eigen::VectorXd scale() const {
    Eigen::VectorXd all(n_shared() + 2);
    all << sigma, extrinsics_sigma, own_sigma;
    return all;
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

/// The prior of scaled unknowns: r = u.
class PriorCost final : public ceres::CostFunction {
 public:
  explicit PriorCost(int size) {
    set_num_residuals(size);
    *mutable_parameter_block_sizes() = {size};
  }
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const int n = num_residuals();
    std::copy_n(parameters[0], n, residuals);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::MatrixXd>(jacobians[0], n, n).setIdentity();
    }
    return true;
  }
};

}  // namespace viwo::calibration
