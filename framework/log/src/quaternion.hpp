// The check that all readers of poses apply to a quaternion.
#pragma once

#include <cmath>

#include <Eigen/Geometry>

namespace viwo::log {

/// False when the norm is off by more than 1e-3 (or not finite). Otherwise `q` is of unit norm on
/// return; rounding of the order of what doubles give anyway is left alone, so that a pose that we
/// wrote reads back to the same bits.
inline bool make_unit(Eigen::Quaterniond& q) {
  const double error = std::abs(q.norm() - 1.);
  if (!(error <= 1e-3)) return false;
  if (error > 1e-12) q.normalize();
  return true;
}

}  // namespace viwo::log
