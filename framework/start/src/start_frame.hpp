// G at a start, and what several ways to start share.
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace viwo {

inline double squared(double x) { return x * x; }

/// R_GtoI for an upright direction `z` given in I, with yaw zero: the x axis of G lies in the x-z
/// plane of I (y-z, if x is nearly vertical).
inline Eigen::Matrix3d R_GtoI_from_up(const Eigen::Vector3d& z) {
  using Eigen::Vector3d;
  const Vector3d reference = std::abs(z.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY();
  const Vector3d x = (reference - z * z.dot(reference)).normalized();
  Eigen::Matrix3d R_GtoI;
  R_GtoI << x, z.cross(x), z;
  return R_GtoI;
}

}  // namespace viwo
