// Least squares over all that a start from cameras and IMU has, from its closed form on.
#pragma once

#include <optional>
#include <vector>

#include "linear_start.hpp"
#include "visual_window.hpp"
#include "viwo/filter/propagation.hpp"

namespace viwo {

struct RefinedStart {
  ImuState state;                   ///< at the last key, in a gravity-aligned frame
  ImuMatrix P = ImuMatrix::Zero();  ///< where the yaw and the position of the last key are exact
  double sigma_scale = 0.;          ///< of the distances of points that are known best, relative
  double sigma_px = 0.;             ///< noise of the sights, as the residuals tell it
  double imu_ratio = 0.;            ///< residuals of the IMU, squared, over what is expected
  std::size_t n_tracks = 0;         ///< that agree
};

/// (F-36), (F-37): nothing when the equations have no solution. Drops the tracks that contradict
/// the others from `window`.
std::optional<RefinedStart> refine_start(VisualWindow& window, const LinearStart& linear,
                                         const Eigen::Vector3d& gyro_bias,
                                         const VisualStartOptions& options);

}  // namespace viwo
