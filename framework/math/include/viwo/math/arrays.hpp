// The plain arrays of measurements as Eigen types.
#pragma once

#include <array>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace viwo {

inline Eigen::Vector3d to_vector(const std::array<double, 3>& values) {
  return {values[0], values[1], values[2]};
}

/// Of a Hamilton quaternion qx, qy, qz, qw; not normalised.
inline Eigen::Quaterniond to_quaternion(const std::array<double, 4>& xyzw) {
  return {xyzw[3], xyzw[0], xyzw[1], xyzw[2]};
}

}  // namespace viwo
