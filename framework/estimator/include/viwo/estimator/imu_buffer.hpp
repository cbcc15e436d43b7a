// Readings of the IMU on their way into the filter.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "viwo/api/measurement.hpp"
#include "viwo/api/rejections.hpp"
#include "viwo/api/stamp_order.hpp"
#include "viwo/estimator/imu_watch.hpp"
#include "viwo/math/set_back_clock.hpp"

namespace viwo {

/// What an IMU can say. Readings beyond are none.
struct ImuLimits {
  double max_gap_s = 0.05;           ///< longer spacings are gaps
  double max_gyro_rad_per_s = 35.;   ///< 2000 deg/s
  double max_accel_m_per_s2 = 160.;  ///< 16 g
};

class ImuBuffer {
 public:
  explicit ImuBuffer(const ImuLimits& limits) : limits_(limits) {}

  /// A reading that is not finite or out of range, not after the last or more than a second ahead
  /// of it (StampJump) is dropped and counted; so are those of an IMU that had noise and now
  /// repeats the same six numbers. One far from the one before (ImuWatch) is held back until the
  /// next one confirms it, or makes it a spike, which is dropped and counted, too.
  void add(const ImuSample& sample, Rejections& rejections);
  /// Nothing more is to come: what is held back has not been confirmed.
  void finish(Rejections& rejections);
  /// By how much the clock of the IMU was set back, s; 0: it was not.
  double set_back_s() const { return clock_.set_back_s(); }
  /// How long after `t_ns` the next reading is, s; 0 where there is none.
  double silent_s(std::int64_t t_ns) const;
  bool empty() const { return buffer_.empty(); }
  std::int64_t newest_ns() const { return samples().back().t_ns; }
  std::span<const ImuSample> samples() const { return buffer_.samples(); }

  /// Readings from `begin_ns` to `end_ns`, interpolated at both; before the first reading that one
  /// holds. Valid until the next call. Readings must reach `end_ns`.
  std::span<const ImuSample> cut(std::int64_t begin_ns, std::int64_t end_ns);
  /// For each reading of the last cut the length of the gap that it ends, or lies in; 0: none.
  std::span<const double> gaps_s() const { return gaps_s_; }
  /// What is not needed to go on from `t_ns`.
  void forget_before(std::int64_t t_ns);
  /// What no start looks at any more.
  void forget_before_start();

 private:
  double gap_s(const ImuSample& before, const ImuSample& after) const;
  bool is_after_the_last(std::int64_t t_ns);
  void push(const ImuSample& sample, Rejections& rejections);

  ImuLimits limits_;
  // An IMU has no pauses of a second; that one is in doubt costs one reading more.
  StampJump jump_{1., 0};
  SetBackClock clock_{20};
  ImuWatch watch_;
  std::optional<ImuSample> in_doubt_;
  TypedBuffer<ImuSample> buffer_;
  std::vector<ImuSample> cut_;
  std::vector<double> gaps_s_;
};

}  // namespace viwo
