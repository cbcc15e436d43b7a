// Cameras that were calibrated together are known better to each other than to the IMU (F-44).
#pragma once

#include <span>

#include <Eigen/Core>

#include "viwo/api/rig.hpp"

namespace viwo {

/// How far the pose of camera `index` is off, theta_ItoC [rad] or p_IinC [m] in its own frame,
/// where that of the first is off by `first` and `own` is drawn for it, with the same sigma.
/// `relative`: part of that sigma by which a camera is off against the first, 0 to 1 (1: what it
/// is off by is its own).
Eigen::Vector3d chained_error(double relative, std::span<const CameraView> cameras,
                              std::size_t index, const Eigen::Vector3d& first,
                              const Eigen::Vector3d& own);

/// Correlations of such errors, of [theta_ItoC, p_IinC] of one camera after the other (6 n x 6 n).
Eigen::MatrixXd chain_correlations(double relative, std::span<const CameraView> cameras);

}  // namespace viwo
