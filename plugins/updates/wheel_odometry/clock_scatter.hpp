// Whether what the wheels say of their clock scatters as their noise explains. Equations: model.md
// beside this file.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "viwo/api/noise_scale.hpp"

namespace viwo::wheel_odometry {

/// Of a run. Wheels slip, and tyres give way, where the motion changes, which is where the clock
/// shows: for seconds on end they say of it what is not so.
class ClockScatter {
 public:
  /// An interval: its length, the derivative of its log-likelihood by the time offset, 1/s, and the
  /// variance that this ought to have.
  void add(double duration_s, double score, double variance) {
    if (!(duration_s > 0.) || !std::isfinite(score) || !(variance > 0.)) return;
    constexpr double kBlock_s = 5.;  // of motion that tells something
    ++n_;
    block_.duration_s += duration_s;
    block_.score += score;
    block_.variance += variance;
    if (block_.duration_s < kBlock_s) return;
    squares_ += block_.score * block_.score;
    variances_ += block_.variance;
    of_squares_ += 2. * block_.variance * block_.variance;
    block_ = {};
  }

  /// By how many times its sigma it scatters (WO-22); 1 where that may be chance.
  double factor() const {
    constexpr double kSigmas = 5.;
    if (!(variances_ > 0.)) return 1.;
    const double found = squares_ / variances_;
    const bool is_beyond_chance = found > 1. + kSigmas * std::sqrt(of_squares_) / variances_;
    return is_beyond_chance ? std::sqrt(found) : 1.;
  }

  void append_to(std::vector<NoiseFound>& out) const {
    if (factor() > 1.) {
      out.push_back({"t_OtoI (scatter of its intervals, in sigmas)", "", 1., factor(), n_});
    }
  }

 private:
  struct Block {
    double duration_s = 0., score = 0., variance = 0.;
  };

  std::int64_t n_ = 0;
  Block block_;  ///< that goes on
  double squares_ = 0., variances_ = 0., of_squares_ = 0.;
};

}  // namespace viwo::wheel_odometry
