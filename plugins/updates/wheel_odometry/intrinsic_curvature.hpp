// What the derivatives by uncertain intrinsics leave of a preintegrated pose, as noise. Equations:
// model.md beside this file.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "viwo/wheel/preintegration.hpp"

namespace viwo::wheel_odometry {

/// Rolling rows know of the direction of a wheel at second order only: learned at first order, from
/// what the linearisation point is off by, it would be learned wrong.
class IntrinsicCurvature {
 public:
  void start(std::shared_ptr<const WheelModel> model, const PreintegrationOptions& options) {
    preintegrator_.emplace(std::move(model), options);
    intervals_ = 0.;
    unchecked_ = 0;
  }

  /// (WO-18) of `pose`, integrated from begin_ns to end_ns at x_WI with the weights there, for
  /// intrinsics of covariance P. Zero where it is negligible, and for a few intervals after.
  Eigen::Matrix3d noise(std::span<const EncoderSample> encoders, std::int64_t begin_ns,
                        std::int64_t end_ns, const Intrinsics& x_WI, const IntrinsicMatrix& P,
                        const PreintegratedPose& pose) {
    ++intervals_;
    if (P.cols() == 0 || --unchecked_ >= 0) return Eigen::Matrix3d::Zero();
    const Eigen::Matrix3d common = intervals_ * left_out(encoders, begin_ns, end_ns, x_WI, P, pose);
    const double share = common.diagonal().cwiseQuotient(pose.P_g.diagonal()).sum();
    if (share >= kNegligible) return common;
    unchecked_ = kIntervalsUnchecked;
    return Eigen::Matrix3d::Zero();
  }

 private:
  /// Step for the derivatives, in units of the uncertainty.
  static constexpr double kStep = 0.2;
  /// In units of the noise of the encoders, as variances.
  static constexpr double kNegligible = 0.01;
  static constexpr int kIntervalsUnchecked = 5;

  Eigen::Matrix3d left_out(std::span<const EncoderSample> encoders, std::int64_t begin_ns,
                           std::int64_t end_ns, const Intrinsics& x_WI, const IntrinsicMatrix& P,
                           const PreintegratedPose& pose) {
    const Eigen::Index n = P.cols();
    eigen_.compute(P);
    const IntrinsicMatrix L =
        eigen_.eigenvectors() * eigen_.eigenvalues().cwiseMax(0.).cwiseSqrt().asDiagonal();
    // Row i of M[a]: how the derivatives of g[a] change along direction i.
    std::array<IntrinsicMatrix, 3> M;
    for (IntrinsicMatrix& of_row : M) of_row.setZero(n, n);
    preintegrator_->set_weights_at(x_WI);
    for (Eigen::Index i = 0; i < n; ++i) {
      if (L.col(i).isZero(0.)) continue;
      preintegrator_->set_intrinsics(x_WI + kStep * L.col(i));
      preintegrator_->integrate(encoders, begin_ns, end_ns, moved_);
      const IntrinsicJacobian change = (moved_.J_g_WI - pose.J_g_WI) * L / kStep;
      for (int a = 0; a < 3; ++a) M[static_cast<std::size_t>(a)].row(i) = change.row(a);
    }
    Eigen::Matrix3d C;
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) {
        C(a, b) = M[static_cast<std::size_t>(a)].cwiseProduct(M[static_cast<std::size_t>(b)]).sum();
      }
    }
    if (!C.allFinite()) C.setZero();
    return C;
  }

  std::optional<Preintegrator> preintegrator_;
  PreintegratedPose moved_;
  Eigen::SelfAdjointEigenSolver<IntrinsicMatrix> eigen_;
  double intervals_ = 0.;
  int unchecked_ = 0;
};

}  // namespace viwo::wheel_odometry
