// Whether one number of a sensor stops changing while the sensor goes on.
#pragma once

#include <cstdint>

namespace viwo {

class StuckChannel {
 public:
  /// Readings in time order. `goes_on`: this one had reason to change. Others that repeat the one
  /// before count neither for the channel nor against it.
  void add(double value, std::int64_t t_ns, bool goes_on);

  /// The longest time that cannot be true of a channel that else changes with every reading.
  bool was_stuck() const { return longest_ > 0; }
  double value() const { return value_; }
  std::int64_t from_ns() const { return from_ns_; }
  std::int64_t to_ns() const { return to_ns_; }

 private:
  static constexpr std::int64_t kMostRepeated = 100;
  static constexpr double kLongest_s = 1.;

  bool is_first_ = true;
  double last_ = 0.;
  std::int64_t n_steps_ = 0, n_changes_ = 0;  ///< without what is stuck
  // The same number: how often so far, and since when.
  std::int64_t repeated_ = 0;
  std::int64_t since_ns_ = 0;
  std::int64_t longest_ = 0;
  double value_ = 0.;
  std::int64_t from_ns_ = 0, to_ns_ = 0;
};

}  // namespace viwo
