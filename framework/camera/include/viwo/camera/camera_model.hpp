// Camera models of Kalibr: pinhole with radial-tangential, or with equidistant (fisheye)
// distortion.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "viwo/api/filter_view.hpp"

namespace viwo {

using PixelJacobian = Eigen::Matrix<double, 2, 3>;       ///< d [u, v] / d p_C, px/m
using IntrinsicsJacobian = Eigen::Matrix<double, 2, 8>;  ///< d [u, v] / d CameraView::intrinsics

/// Pixel of a point given in the camera frame (z forward, x right, y down). Nothing when the model
/// has no image of it: behind the camera (radtan), at or beyond 180 degrees off the axis
/// (equidistant), or so far out that the distortion polynomial folds back.
bool project(const CameraView& camera, const Eigen::Vector3d& p_C, Eigen::Vector2d& uv);

/// The same with derivatives; `J_intrinsics` may be null.
bool project(const CameraView& camera, const Eigen::Vector3d& p_C, Eigen::Vector2d& uv,
             PixelJacobian& J_point, IntrinsicsJacobian* J_intrinsics = nullptr);

/// Unit vector in C towards what is seen at a pixel, and the derivative of the pixel by a point
/// there. Nothing when no direction projects to it.
std::optional<Eigen::Vector3d> unproject(const CameraView& camera, const Eigen::Vector2d& uv,
                                         PixelJacobian* J_ray = nullptr);

/// Inside of the image.
inline bool in_image(const CameraView& camera, const Eigen::Vector2d& uv) {
  return uv.x() >= 0. && uv.y() >= 0. && uv.x() <= camera.width_px - 1. &&
         uv.y() <= camera.height_px - 1.;
}

}  // namespace viwo
