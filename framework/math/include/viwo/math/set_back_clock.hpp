// Whether a clock was set back.
#pragma once

#include <cstdint>

#include "viwo/api/measurement.hpp"

namespace viwo {

/// Tells a clock that was set back from single samples that come late: stamps without a break, in
/// their order, all of them long before the newest.
class SetBackClock {
 public:
  /// `many` such stamps say so.
  explicit SetBackClock(int many) : many_(many) {}

  /// Whether it was; `newest_ns` is the newest stamp before `t_ns`.
  bool see(std::int64_t t_ns, std::int64_t newest_ns) {
    constexpr double kLongS = 1.;
    const double behind_s = seconds_between(t_ns, newest_ns);
    const bool follows = n_behind_ == 0 || t_ns > last_ns_;
    n_behind_ = behind_s <= kLongS ? 0 : follows ? n_behind_ + 1 : 1;
    last_ns_ = t_ns;
    if (n_behind_ == 1) behind_s_ = behind_s;
    return n_behind_ >= many_;
  }
  /// By how much, s; 0: it was not.
  double set_back_s() const { return n_behind_ < many_ ? 0. : behind_s_; }

 private:
  int many_;
  int n_behind_ = 0;
  std::int64_t last_ns_ = 0;
  double behind_s_ = 0.;
};

}  // namespace viwo
