// Cameras that were calibrated together are known better to each other than to the IMU (F-44).
#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>

#include "viwo/api/rig.hpp"

namespace viwo {

/// How far the poses of cameras are off, one after the other: theta_ItoC [rad] or p_IinC [m], in
/// the frame of each. `relative`: part of a camera's sigma by which it is off against the first, 0
/// to 1 (1: what it is off by is its own).
class ChainedErrors {
 public:
  explicit ChainedErrors(double relative) : relative_(relative) {}
  /// Of the next camera, for which `own` is drawn, all with one sigma. R_ItoC: before it is off.
  Eigen::Vector3d next(const Eigen::Matrix3d& R_ItoC, const Eigen::Vector3d& own);

 private:
  struct First {
    Eigen::Matrix3d R_ItoC;
    Eigen::Vector3d error;
  };
  double relative_;
  std::optional<First> first_;
};

/// Correlations of such errors, of [theta_ItoC, p_IinC] of one camera after the other (6 n x 6 n).
Eigen::MatrixXd chain_correlations(double relative, std::span<const CameraView> cameras);

}  // namespace viwo
