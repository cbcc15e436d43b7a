// What the updates share that look how their derivatives by the intrinsics bend within the
// uncertainty (WP-6 of wheel_parity, WO-18 of wheel_odometry).
#pragma once

#include <algorithm>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "viwo/api/kinematic_model.hpp"

namespace viwo {

/// Step for the change of derivatives along a direction, in units of its uncertainty.
inline constexpr double kCurvatureStep = 0.2;
/// Curvature that adds less than this to the noise is left out, and not looked for in the next
/// intervals: the uncertainty of constants does not grow.
inline constexpr double kNegligibleCurvature = 0.01;
inline constexpr int kIntervalsUnchecked = 5;

/// L of P = L L^T; its columns are the directions.
inline IntrinsicMatrix directions_of(const IntrinsicMatrix& P,
                                     Eigen::SelfAdjointEigenSolver<IntrinsicMatrix>& eigen) {
  eigen.compute(P);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.).cwiseSqrt().asDiagonal();
}

/// How many of `intervals`, of duration_s each, have the same intrinsics: those that wander are
/// others after wander_time_s (0: never).
inline double intervals_alike(double intervals, double wander_time_s, double duration_s) {
  return wander_time_s > 0. ? std::min(intervals, 1. + wander_time_s / duration_s) : intervals;
}

}  // namespace viwo
