// The closed form of a start from cameras and IMU: what the refinement begins with.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "visual_window.hpp"

namespace viwo {

/// The gyro's bias, rad/s, by the epipolar geometry of the images (F-34).
Eigen::Vector3d epipolar_gyro_bias(const VisualWindow& window, const VisualStartOptions& options);

/// In the frame of the IMU at the first key.
struct LinearStart {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< m/s
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();   ///< m/s^2, points down
  std::vector<Eigen::Vector3d> points;                 ///< of each track, m
  double in_front = 0.;  ///< share of the points that lie in front of the cameras
};

/// (F-35): nothing when it has no solution.
std::optional<LinearStart> solve_linear_start(const VisualWindow& window,
                                              const Eigen::Vector3d& gyro_bias,
                                              const VisualStartOptions& options);

/// By how much the directions to points change over the window when the rotation is taken off:
/// median over the tracks, rad.
double parallax_rad(const VisualWindow& window, const Eigen::Vector3d& gyro_bias,
                    const VisualStartOptions& options);

}  // namespace viwo
