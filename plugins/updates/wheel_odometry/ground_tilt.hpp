// Whether the roll and the pitch that a base turns by are the ground's or noise, and what the
// intervals before tell of them. Equations: model.md beside this file.
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

#include "lagged.hpp"

namespace viwo::wheel_odometry {

/// Of the latest intervals. On a plane the tilt goes with the yaw, as the mount is not known
/// better.
class GroundTilt {
 public:
  /// `sigmas`: by how many of its own the scatter has to be above noise.
  explicit GroundTilt(double sigmas = 0.) : sigmas_(sigmas) {}

  /// An interval: its length, yaw and [roll, pitch] of O, rad, the variance of one of the latter,
  /// and that of the bias of the gyro (rad^2/s^2), by which they are off alike.
  void add(double duration_s, double yaw, const Eigen::Vector2d& tilt, double variance,
           double bias_variance = 0.) {
    if (!(variance > 0.) || !(duration_s > 0.) || !tilt.allFinite() || !std::isfinite(yaw)) return;
    constexpr double kMemory = 100.;
    const double kept = 1. - 1. / kMemory;
    n_ = kept * n_ + 1.;
    yaw_squares_ = kept * yaw_squares_ + yaw * yaw / variance;
    products_ = kept * products_ + yaw * tilt / variance;
    bias_variance_ = bias_variance;
    times_ = kept * times_ + duration_s * duration_s / variance;
    yaw_times_ = kept * yaw_times_ + yaw * duration_s / variance;
    time_products_ = kept * time_products_ + duration_s * tilt / variance;
    squares_ = kept * squares_ + tilt.squaredNorm() / variance;

    const Eigen::Vector2d rate = tilt / duration_s;
    const Eigen::Vector2d unexpected = rate - expected(duration_s) / duration_s;
    unexpected_.add(unexpected, kept);
    rates_.add(rate, kept);
  }

  /// Whether noise does not explain what was seen (WO-16); false where nothing was.
  bool tilts() const {
    if (!(n_ > 0.)) return false;
    const double scatter = (squares_ - explained()) / (2. * n_);
    return scatter > 1. + sigmas_ / std::sqrt(n_);
  }

  /// [roll, pitch] of an interval that follows those added, of the one before the last (WO-17).
  Eigen::Vector2d expected(double duration_s) const {
    if (!(rates_.products() > 0.) || !tilts()) return Eigen::Vector2d::Zero();
    return rates_.share() * duration_s * rates_.before();
  }

  /// How many neighbouring intervals have alike what of the tilt was not expected: half a wave's
  /// worth (WO-20).
  double alike() const {
    if (!(unexpected_.products() > 0.) || !tilts()) return 1.;
    const double most = n_ * (n_ + 1.);  // of equal ones, all together tell what one does
    const double r = unexpected_.correlation();
    return r < 1. ? std::clamp(2. / std::acos(r), 1., most) : most;
  }

 private:
  /// Of squares_: what goes with the yaw, and the bias as far as it may be so.
  double explained() const {
    const double slope = yaw_squares_ > 0. ? 1. / yaw_squares_ : 0.;
    const double by_yaw = slope * products_.squaredNorm();
    if (!(bias_variance_ > 0.)) return by_yaw;
    const Eigen::Vector2d left = time_products_ - slope * yaw_times_ * products_;
    return by_yaw +
           left.squaredNorm() / (times_ - slope * yaw_times_ * yaw_times_ + 1. / bias_variance_);
  }

  double sigmas_;
  double n_ = 0.;
  double yaw_squares_ = 0., times_ = 0., yaw_times_ = 0., squares_ = 0.;
  Eigen::Vector2d products_ = Eigen::Vector2d::Zero(), time_products_ = products_;
  double bias_variance_ = 0.;
  Lagged<2, 2> rates_;       ///< rad/s
  Lagged<2, 1> unexpected_;  ///< of them
};

}  // namespace viwo::wheel_odometry
