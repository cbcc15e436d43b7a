// How much of the roll and the pitch that a base turns by is the ground's, and how much is noise.
// Equations: model.md beside this file.
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace viwo::wheel_odometry {

/// Of the latest intervals. On a plane the tilt goes with the yaw, as the mount is not known
/// better.
class GroundTilt {
 public:
  /// `sigmas`: by how many of its own the scatter has to be above noise.
  explicit GroundTilt(double sigmas = 0.) : sigmas_(sigmas) {}

  /// An interval: yaw and [roll, pitch] of O, rad, and the variance of one of the latter.
  void add(double yaw, const Eigen::Vector2d& tilt, double variance) {
    if (!(variance > 0.) || !tilt.allFinite() || !std::isfinite(yaw)) return;
    constexpr double kMemory = 100.;
    const double kept = 1. - 1. / kMemory;
    n_ = kept * n_ + 1.;
    yaw_squares_ = kept * yaw_squares_ + yaw * yaw / variance;
    products_ = kept * products_ + yaw * tilt / variance;
    squares_ = kept * squares_ + tilt.squaredNorm() / variance;
  }

  /// k of (WO-16): 1 where the ground tilts, 0 where noise explains what was seen, or nothing was.
  double share() const {
    if (!(n_ > 0.)) return 0.;
    const double by_yaw = yaw_squares_ > 0. ? products_.squaredNorm() / yaw_squares_ : 0.;
    const double scatter = (squares_ - by_yaw) / (2. * n_);
    const double noise = 1. + sigmas_ / std::sqrt(n_);
    return scatter > noise ? 1. - noise / scatter : 0.;
  }

 private:
  double sigmas_;
  double n_ = 0.;
  double yaw_squares_ = 0., squares_ = 0.;
  Eigen::Vector2d products_ = Eigen::Vector2d::Zero();
};

}  // namespace viwo::wheel_odometry
