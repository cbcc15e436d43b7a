// What the readings of an IMU tell about themselves: units, full scale, a sensor that is stuck.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "sensor_name.hpp"
#include "stuck_channel.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/estimator/imu_watch.hpp"
#include "viwo/plausibility/finding.hpp"

namespace viwo {

/// Median of positive numbers, to one percent, from 0.001 to 1e5.
class LogMedian {
 public:
  void add(double value);
  double value() const;

 private:
  std::vector<std::uint32_t> counts_ = std::vector<std::uint32_t>(1843);
  std::uint64_t total_ = 0;
};

class ImuCheck {
 public:
  ImuCheck(const SensorName& imu, double gravity_m_per_s2)
      : name_(imu.text), unit_key_(imu.key("accel_unit")), gravity_(gravity_m_per_s2) {}

  /// Readings in time order. `moves`: the wheels turn.
  void add(const ImuSample& sample, bool moves);
  /// Times in texts count from `zero_ns`.
  void findings(std::int64_t zero_ns, Findings& out) const;

  /// Mean direction of the specific force in I, of length 1 where it never changed; zero as long
  /// as there are too few readings.
  Eigen::Vector3d up() const;

 private:
  /// One of the six numbers of a reading.
  struct Axis {
    double last = 0.;
    double least = 0., most = 0.;
    double finest = 0.;           ///< smallest change
    double largest = 0.;          ///< |value|
    std::int64_t at_largest = 0;  ///< readings with it
    std::int64_t spikes = 0;
    double spike_sum = 0.;
    void add(double value, double spike);
  };

  void watch_stuck(const ImuSample& sample, bool moves);
  void find_constant(Findings& out) const;
  void find_gravity(Findings& out) const;
  void find_stuck(std::int64_t zero_ns, Findings& out) const;
  void find_stuck_channels(std::int64_t zero_ns, Findings& out) const;
  void find_saturated(Findings& out) const;
  void find_spikes(Findings& out) const;

  std::string name_, unit_key_;
  double gravity_;
  std::int64_t count_ = 0;
  std::int64_t begin_ns_ = 0;
  ImuSample last_;
  std::array<Axis, 6> axes_;  ///< of the gyro, then of the accelerometer
  std::array<StuckChannel, 6> channels_;
  LogMedian force_;  ///< m/s^2
  Eigen::Vector3d direction_sum_ = Eigen::Vector3d::Zero();
  ImuWatch watch_;
  // Readings with the same six numbers: those at hand, and the longest that cannot be true.
  std::int64_t n_equal_ =
      0;  ///< readings like the one before, of each row of them the first hundred
  bool moves_ = false;
  std::int64_t equal_from_ns_ = 0;
  int stuck_ = 0;
  std::int64_t stuck_from_ns_ = 0, stuck_to_ns_ = 0;
};

}  // namespace viwo
