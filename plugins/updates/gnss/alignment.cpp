#include "alignment.hpp"

#include <algorithm>
#include <cmath>

#include "viwo/math/so3.hpp"

namespace viwo::gnss {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

Matrix3d R_GtoE(double yaw_EtoG) { return exp_so3({0., 0., -yaw_EtoG}); }

namespace {

/// Of the larger axis, in the horizontal plane.
double horizontal_variance(const Matrix3d& P) {
  return 0.5 * (P(0, 0) + P(1, 1)) + std::hypot(0.5 * (P(0, 0) - P(1, 1)), P(0, 1));
}

}  // namespace

YawGuess yaw_of(const Baseline& baseline) {
  const Vector2d g = baseline.in_G.head<2>(), e = baseline.in_E.head<2>();
  const double variance = horizontal_variance(baseline.P_G) + horizontal_variance(baseline.P_E);
  const double longer = g.norm() - e.norm();
  const double higher = baseline.in_G.z() - baseline.in_E.z();
  YawGuess guess;
  guess.yaw_EtoG = std::atan2(g.y(), g.x()) - std::atan2(e.y(), e.x());  // (GN-6)
  guess.sigma_rad = std::sqrt(variance) / g.norm();                      // (GN-7)
  // (GN-8)
  guess.chi2 =
      longer * longer / variance + higher * higher / (baseline.P_G(2, 2) + baseline.P_E(2, 2));
  return guess;
}

}  // namespace viwo::gnss
