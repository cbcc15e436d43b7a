// Whether what is measured agrees with what is estimated.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "viwo/estimator/update_runner.hpp"
#include "viwo/filter/filter.hpp"

namespace viwo {

/// Watches whether the updates agree with the estimate at all. When all of them reject nearly all
/// that they measure, it is the filter that is wrong and not the sensors: a gate would lock them
/// out for ever. Then the filter is loosened (Filter::loosen), more each time; if that does not
/// help, the estimate has diverged.
class Contact {
 public:
  /// After each epoch. Why the estimate is not to be believed any more; empty as long as it is.
  std::string epoch(std::span<const UpdateCounts> counts, Filter& filter);

  /// How often the filter was loosened, and when first (IMU clock).
  std::int64_t loosened() const { return loosened_; }
  std::int64_t first_ns() const { return first_ns_; }

 private:
  enum class Verdict : std::uint8_t { kNone, kAgrees, kContradicts };
  Verdict verdict(std::span<const UpdateCounts> counts) const;

  std::vector<UpdateCounts> before_;  ///< at the start of the present period
  std::int64_t begin_ns_ = 0;
  int lost_periods_ = 0;  ///< without a break
  int balance_ = 0;       ///< periods that were lost, less those in touch
  std::int64_t lost_since_ns_ = 0;
  std::int64_t loosened_ = 0;
  std::int64_t first_ns_ = 0;
};

}  // namespace viwo
