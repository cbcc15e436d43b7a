// Readings of the IMU on their way into the filter.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "viwo/api/measurement.hpp"
#include "viwo/api/rejections.hpp"

namespace viwo {

class ImuBuffer {
 public:
  /// Longer spacings are counted.
  explicit ImuBuffer(double max_gap_s) : max_gap_s_(max_gap_s) {}

  /// A reading that is not finite, or not after the last, is dropped and counted.
  void add(const ImuSample& sample, Rejections& rejections);
  bool empty() const { return buffer_.empty(); }
  std::int64_t newest_ns() const { return samples().back().t_ns; }
  std::span<const ImuSample> samples() const { return buffer_.samples(); }

  /// Readings from `begin_ns` to `end_ns`, interpolated at both; before the first reading that one
  /// holds. Valid until the next call. Readings must reach `end_ns`.
  std::span<const ImuSample> cut(std::int64_t begin_ns, std::int64_t end_ns);
  /// What is not needed to go on from `t_ns`.
  void forget_before(std::int64_t t_ns);
  /// What no start looks at any more.
  void forget_before_start();

 private:
  double max_gap_s_;
  TypedBuffer<ImuSample> buffer_;
  std::vector<ImuSample> cut_;
};

}  // namespace viwo
