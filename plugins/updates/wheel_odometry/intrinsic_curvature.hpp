// What the derivatives by uncertain intrinsics leave of a preintegrated pose, as noise. Equations:
// model.md beside this file.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "curvature.hpp"
#include "viwo/wheel/preintegration.hpp"

namespace viwo::wheel_odometry {

/// Rolling rows know of the direction of a wheel at second order only: learned at first order, from
/// what the linearisation point is off by, it would be learned wrong.
class IntrinsicCurvature {
 public:
  void start(std::shared_ptr<const WheelModel> model, const PreintegrationOptions& options) {
    preintegrator_.emplace(std::move(model), options);
    alike_ = 0.;
    unchecked_ = 0;
  }

  /// (WO-18) of `pose`, integrated from begin_ns to end_ns at x_WI with the weights there, for
  /// intrinsics of covariance P; `wander_time_s` after which part of them are others, 0: never.
  /// Zero where it is negligible, and for a few intervals after.
  Eigen::Matrix3d noise(std::span<const EncoderSample> encoders, std::int64_t begin_ns,
                        std::int64_t end_ns, const Intrinsics& x_WI, const IntrinsicMatrix& P,
                        double wander_time_s, const PreintegratedPose& pose) {
    count(pose);
    if (P.cols() == 0 || --unchecked_ >= 0) return Eigen::Matrix3d::Zero();
    const Eigen::Matrix3d common = intervals_alike(alike_, wander_time_s, pose.duration_s) *
                                   left_out(encoders, begin_ns, end_ns, x_WI, P, pose);
    const double share = common.diagonal().cwiseQuotient(pose.P_g.diagonal()).sum();
    if (share >= kNegligibleCurvature) return common;
    unchecked_ = kIntervalsUnchecked;
    return Eigen::Matrix3d::Zero();
  }

 private:
  /// Motions in directions further apart than this bend otherwise, rad.
  static constexpr double kAlike = 0.1;

  /// (WO-19)
  void count(const PreintegratedPose& pose) {
    const Eigen::Vector3d rate = pose.g / pose.duration_s;
    const Eigen::LLT<Eigen::Matrix3d> noise(pose.P_g);
    const Eigen::Vector3d now = noise.matrixL().solve(rate);
    const Eigen::Vector3d before = noise.matrixL().solve(motion_);
    const double sine2 =
        now.cross(before).squaredNorm() / (now.squaredNorm() * before.squaredNorm());
    const double kept = std::exp(-sine2 / (kAlike * kAlike));
    alike_ = 1. + (std::isfinite(kept) ? kept * alike_ : 0.);
    motion_ += (rate - motion_) / alike_;
  }

  Eigen::Matrix3d left_out(std::span<const EncoderSample> encoders, std::int64_t begin_ns,
                           std::int64_t end_ns, const Intrinsics& x_WI, const IntrinsicMatrix& P,
                           const PreintegratedPose& pose) {
    const Eigen::Index n = P.cols();
    const IntrinsicMatrix L = directions_of(P, eigen_);
    // Row i of M[a]: how the derivatives of g[a] change along direction i.
    std::array<IntrinsicMatrix, 3> M;
    for (IntrinsicMatrix& of_row : M) of_row.setZero(n, n);
    preintegrator_->set_intrinsics(x_WI);
    for (Eigen::Index i = 0; i < n; ++i) {
      if (L.col(i).isZero(0.)) continue;
      preintegrator_->move_intrinsics(x_WI + kCurvatureStep * L.col(i));
      preintegrator_->integrate(encoders, begin_ns, end_ns, moved_);
      const IntrinsicJacobian change = (moved_.J_g_WI - pose.J_g_WI) * L / kCurvatureStep;
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
  double alike_ = 0.;                                 ///< intervals of the same motion
  Eigen::Vector3d motion_ = Eigen::Vector3d::Zero();  ///< their mean, per second
  int unchecked_ = 0;
};

}  // namespace viwo::wheel_odometry
