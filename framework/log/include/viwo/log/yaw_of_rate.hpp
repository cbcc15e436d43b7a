// A heading of a gyro that gives the rate of the yaw alone.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "viwo/api/measurement.hpp"

namespace viwo::log {

/// The integral of a yaw rate, from zero, by the trapezoidal rule. Over a gap it goes on as if the
/// rate had been that at its ends: who uses headings knows the gap by their stamps.
class YawOfRate {
 public:
  /// Heading at a reading; NaN where it is not finite, and no integral over one that is not later
  /// than the last.
  HeadingSample add(std::int64_t t_ns, double rate_rad_per_s) {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    if (!std::isfinite(rate_rad_per_s)) return {t_ns, kNaN};
    if (has_last_ && t_ns <= last_ns_) return {t_ns, yaw_rad_};
    if (has_last_) {
      yaw_rad_ += 0.5 * (last_rad_per_s_ + rate_rad_per_s) * seconds_between(last_ns_, t_ns);
    }
    has_last_ = true;
    last_ns_ = t_ns;
    last_rad_per_s_ = rate_rad_per_s;
    return {t_ns, yaw_rad_};
  }

 private:
  bool has_last_ = false;
  std::int64_t last_ns_ = 0;
  double last_rad_per_s_ = 0., yaw_rad_ = 0.;
};

}  // namespace viwo::log
