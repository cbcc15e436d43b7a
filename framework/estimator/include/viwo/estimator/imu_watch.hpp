// What the readings of an IMU tell one after the other: whether it repeats itself, and whether one
// of them is a spike.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "viwo/api/measurement.hpp"

namespace viwo {

class ImuWatch {
 public:
  /// Gyro, then accelerometer.
  static constexpr std::size_t kAxes = 6;
  using Values = std::array<double, kAxes>;
  static Values values_of(const ImuSample& sample);

  /// Readings in time order.
  void add(const ImuSample& sample);

  /// The newest reading is one of many that are the same, of an IMU that had noise.
  bool is_stuck() const { return is_noise() && n_repeated_ > kMostRepeated; }
  /// How often the newest reading has repeated the one before without a break.
  int n_repeated() const { return n_repeated_; }
  /// Changes of white noise turn back two times of three, those of a motion that is sampled often
  /// enough hardly ever; those of any axis tell. What has no noise may well repeat itself.
  bool is_noise() const;

  /// The newest reading is far from the one before, after calm: a spike, unless the next one
  /// confirms it.
  bool is_in_doubt() const { return departs_ && n_calm_ >= kCalm; }
  /// For each axis by how much the reading before the newest stood out of both its neighbours, far
  /// more than these from each other and than readings usually change; 0: it did not.
  const Values& spike() const { return spike_; }
  bool was_spike() const;

 private:
  static constexpr int kMostRepeated = 10;
  static constexpr int kFewest = 100;  ///< readings, or changes, to know what is usual
  static constexpr int kCalm = 20;     ///< fewer may be the begin of a vibration

  bool is_usual(std::size_t axis, double change) const;
  void watch_spike(const Values& now);
  void watch_usual(const Values& now);

  std::int64_t count_ = 0;
  std::int64_t t_ns_ = 0;  ///< of the newest
  Values newest_{};
  Values before_{};  ///< the one before, or before that where that is a spike
  Values usual_{};   ///< mean |change| of the last hundred readings
  Values spike_{};
  bool departs_ = false;  ///< the newest, from before_
  int n_calm_ = 0;        ///< readings up to before_ that were near the one before, as usual
  int n_repeated_ = 0;
  struct Changes {
    double last = 0.;
    std::int64_t n = 0, n_turns_back = 0;
  };
  std::array<Changes, kAxes> changes_;
};

}  // namespace viwo
