// The point of a track by least squares, and whether it moves: what a velocity of it explains.
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace viwo::visual {

/// Sums of squares and products of the rows [H_f, t H_f D, r] of a track, lower triangle; t [s]: of
/// the sights, from any instant on; D: the derivative of the point's coordinates by the point.
using TrackSums = Eigen::Matrix<double, 7, 7>;

/// Cholesky factor of the sums; its last row is L^-1 of what the others say of the residual.
struct PointFit {
  TrackSums L = TrackSums::Identity();
  double chi2 = 0.;            ///< of the track, outside of what the point explains
  double chi2_of_motion = 0.;  ///< the part of it that a constant velocity explains (VF-23)

  auto y_f() const { return L.block<1, 3>(6, 0).transpose(); }

  /// `information_of_rho`: what is known of the inverse distance besides. False when all that does
  /// not determine the point within double precision.
  bool solve(const TrackSums& sums, double information_of_rho) {
    // Where a velocity cannot be told from another point (one camera that moves evenly), this one
    // is known to be less.
    constexpr double kSpeed = 10.;  // m/s
    constexpr double kSmallestPivot = 1e-12;
    L.setZero();
    for (int j = 0; j < 6; ++j) {
      const double known = j > 2 ? 1. / (kSpeed * kSpeed) : j == 2 ? information_of_rho : 0.;
      double pivot = sums(j, j) + known;
      const double limit = j < 3 ? kSmallestPivot * pivot : 0.;
      for (int k = 0; k < j; ++k) pivot -= L(j, k) * L(j, k);
      if (!(pivot > limit)) return false;
      L(j, j) = std::sqrt(pivot);
      for (int i = j + 1; i < 7; ++i) {
        double sum = sums(i, j);
        for (int k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
        L(i, j) = sum / L(j, j);
      }
    }
    chi2 = std::fmax(0., sums(6, 6) - y_f().squaredNorm());
    chi2_of_motion = std::fmin(chi2, L.block<1, 3>(6, 3).squaredNorm());
    return true;
  }
};

}  // namespace viwo::visual
