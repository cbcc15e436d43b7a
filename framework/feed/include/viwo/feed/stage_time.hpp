// How long something took, each time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "viwo/feed/bounded_series.hpp"

namespace viwo {

/// Statistics of the time that a stage took per epoch.
struct StageTime {
  double mean_ms = 0.;
  double p95_ms = 0.;
  double p99_ms = 0.;
  double max_ms = 0.;
};

StageTime stage_time(std::vector<double> ms);

/// Times that something took, however often: the mean and the largest of all, the 95th percentile
/// of so many that are evenly spread.
class TimeStatistics {
 public:
  void add(double ms) {
    sum_ms_ += ms;
    max_ms_ = std::max(max_ms_, ms);
    ++n_;
    sample_.add(ms);
  }
  bool is_empty() const { return n_ == 0; }
  StageTime stage() const {
    StageTime stage = stage_time(sample_.points());
    if (n_ > 0) stage.mean_ms = sum_ms_ / static_cast<double>(n_);
    stage.max_ms = max_ms_;
    return stage;
  }

 private:
  static constexpr std::size_t kMost = 16'384;

  BoundedSeries<double> sample_{kMost};
  double sum_ms_ = 0.;
  double max_ms_ = 0.;
  std::int64_t n_ = 0;
};

}  // namespace viwo
