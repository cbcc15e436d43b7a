// What the intervals before tell of a turn that is not above the noise of one. Equations: model.md
// beside this file.
#pragma once

#include <cmath>

#include "lagged.hpp"

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
    rates_.add(Rates::Vector(rate), kept);
    noise_ = noise / (duration_s * duration_s);
    lasting_ = lasting / (duration_s * duration_s);
  }

  /// Yaw of an interval that follows those added, of the one before the last (WO-21).
  double expected(double duration_s) const {
    if (!(n_ > 0.)) return 0.;
    const double by_chance = sigmas_ * (sigmas_ * lasting_ + noise_ / std::sqrt(n_));
    if (!(rates_.products() > n_ * by_chance)) return 0.;
    return rates_.share() * duration_s * rates_.before()[0];
  }

 private:
  using Rates = Lagged<1, 2>;  // rad/s

  double sigmas_;
  double n_ = 0.;
  Rates rates_;
  double noise_ = 0., lasting_ = 0.;  ///< of the latest rate, squared
};

}  // namespace viwo::wheel_odometry
