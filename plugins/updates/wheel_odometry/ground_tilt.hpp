// Whether the roll and the pitch that a base turns by are the ground's or noise, and what the
// intervals before tell of them. Equations: model.md beside this file.
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

namespace viwo::wheel_odometry {

/// Of the latest intervals. On a plane the tilt goes with the yaw, as the mount is not known
/// better.
class GroundTilt {
 public:
  /// `sigmas`: by how many of its own the scatter has to be above noise.
  explicit GroundTilt(double sigmas = 0.) : sigmas_(sigmas) {}

  /// An interval: its length, yaw and [roll, pitch] of O, rad, and the variance of one of the
  /// latter.
  void add(double duration_s, double yaw, const Eigen::Vector2d& tilt, double variance) {
    if (!(variance > 0.) || !(duration_s > 0.) || !tilt.allFinite() || !std::isfinite(yaw)) return;
    constexpr double kMemory = 100.;
    const double kept = 1. - 1. / kMemory;
    n_ = kept * n_ + 1.;
    yaw_squares_ = kept * yaw_squares_ + yaw * yaw / variance;
    products_ = kept * products_ + yaw * tilt / variance;
    squares_ = kept * squares_ + tilt.squaredNorm() / variance;

    const Eigen::Vector2d rate = tilt / duration_s;
    const Eigen::Vector2d unexpected = rate - expected(duration_s) / duration_s;
    unexpected_repeated_ = kept * unexpected_repeated_ + unexpected.dot(unexpected_);
    unexpected_squares_ = kept * unexpected_squares_ + unexpected_.squaredNorm();
    unexpected_ = unexpected;
    repeated_ = kept * repeated_ + rate.dot(before_);
    before_squares_ = kept * before_squares_ + before_.squaredNorm();
    before_ = last_;
    last_ = rate;
  }

  /// Whether noise does not explain what was seen (WO-16); false where nothing was.
  bool tilts() const {
    if (!(n_ > 0.)) return false;
    const double by_yaw = yaw_squares_ > 0. ? products_.squaredNorm() / yaw_squares_ : 0.;
    const double scatter = (squares_ - by_yaw) / (2. * n_);
    return scatter > 1. + sigmas_ / std::sqrt(n_);
  }

  /// [roll, pitch] of an interval that follows those added, of the one before the last (WO-17).
  Eigen::Vector2d expected(double duration_s) const {
    if (!(repeated_ > 0.) || !tilts()) return Eigen::Vector2d::Zero();
    return std::min(repeated_ / before_squares_, 1.) * duration_s * before_;
  }

  /// How many neighbouring intervals have alike what of the tilt was not expected: half a wave's
  /// worth (WO-20).
  double alike() const {
    if (!(unexpected_repeated_ > 0.) || !tilts()) return 1.;
    const double most = n_ * (n_ + 1.);  // of equal ones, all together tell what one does
    const double r = unexpected_repeated_ / unexpected_squares_;
    return r < 1. ? std::clamp(2. / std::acos(r), 1., most) : most;
  }

 private:
  double sigmas_;
  double n_ = 0.;
  double yaw_squares_ = 0., squares_ = 0.;
  Eigen::Vector2d products_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d last_ = Eigen::Vector2d::Zero(), before_ = last_;  ///< rates, rad/s
  double repeated_ = 0., before_squares_ = 0.;  ///< of a rate and that two intervals before
  Eigen::Vector2d unexpected_ = Eigen::Vector2d::Zero();  ///< of the latest rate
  double unexpected_repeated_ = 0., unexpected_squares_ = 0.;
};

}  // namespace viwo::wheel_odometry
