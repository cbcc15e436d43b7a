// What the intervals before tell of a turn that is not above the noise of one. Equations: model.md
// beside this file.
#pragma once

#include <algorithm>
#include <cmath>

namespace viwo::wheel_odometry {

/// Of the latest intervals: a turn that goes on is one, though it is small.
class SmallTurn {
 public:
  /// `sigmas`: by how many of its own what is repeated has to be above noise.
  explicit SmallTurn(double sigmas = 0.) : sigmas_(sigmas) {}

  /// An interval: its length, its yaw, rad, and the variances of the latter: `noise` of this
  /// interval alone, `lasting` of calibration. A turn that nobody would take for noise says nothing
  /// about small ones.
  void add(double duration_s, double yaw, double noise, double lasting) {
    if (!(duration_s > 0.) || !std::isfinite(yaw)) return;
    constexpr double kMemory = 30.;
    const double kept = 1. - 1. / kMemory;
    const bool small = yaw * yaw <= 4. * sigmas_ * sigmas_ * (noise + lasting);
    const double rate = small ? yaw / duration_s : 0.;
    n_ = kept * n_ + 1.;
    repeated_ = kept * repeated_ + rate * before_;
    before_squares_ = kept * before_squares_ + before_ * before_;
    noise_ = noise / (duration_s * duration_s);
    lasting_ = lasting / (duration_s * duration_s);
    before_ = last_;
    last_ = rate;
  }

  /// Yaw of an interval that follows those added, of the one before the last (WO-21).
  double expected(double duration_s) const {
    if (!(n_ > 0.)) return 0.;
    const double by_chance = sigmas_ * (sigmas_ * lasting_ + noise_ / std::sqrt(n_));
    if (!(repeated_ > n_ * by_chance)) return 0.;
    return std::min(repeated_ / before_squares_, 1.) * duration_s * before_;
  }

 private:
  double sigmas_;
  double n_ = 0.;
  double last_ = 0., before_ = 0.;              ///< rates, rad/s
  double repeated_ = 0., before_squares_ = 0.;  ///< of a rate and that two intervals before
  double noise_ = 0., lasting_ = 0.;            ///< of the latest rate, squared
};

}  // namespace viwo::wheel_odometry
