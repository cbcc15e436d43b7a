// How the local frame E of the fixes lies in the world G of the filter, and what two places tell of
// its yaw. Equations: model.md beside this file.
#pragma once

#include <Eigen/Core>

namespace viwo::gnss {

/// E in G: a turn about the vertical, that is common to both, and a position.
struct Alignment {
  double yaw_EtoG = 0.;  ///< rad
  Eigen::Vector3d p_EinG = Eigen::Vector3d::Zero();
};

Eigen::Matrix3d R_GtoE(double yaw_EtoG);

/// From one place to another one, in both frames.
struct Baseline {
  Eigen::Vector3d in_G = Eigen::Vector3d::Zero();
  Eigen::Matrix3d P_G = Eigen::Matrix3d::Zero();  ///< covariance of in_G, m^2
  Eigen::Vector3d in_E = Eigen::Vector3d::Zero();
  Eigen::Matrix3d P_E = Eigen::Matrix3d::Zero();
};

struct YawGuess {
  double yaw_EtoG = 0.;   ///< rad
  double sigma_rad = 0.;  ///< infinite for places above each other
  double chi2 = 0.;  ///< of length and rise, which no yaw changes: at most that of 3 dimensions
};

YawGuess yaw_of(const Baseline& baseline);

}  // namespace viwo::gnss
