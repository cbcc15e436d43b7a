// Counting what an update did not use, without allocating.
#pragma once

#include <cstdint>
#include <vector>

#include "viwo/api/sensor.hpp"
#include "viwo/math/time_text.hpp"

namespace viwo {

/// One reason for leaving data out: how often, and the time of the first.
struct Tally {
  const char* reason;
  std::int64_t count = 0;
  std::int64_t first_ns = 0;

  /// Adds `n` (nothing for 0) that happened at `t_ns`.
  void add(std::int64_t n, std::int64_t t_ns) {
    if (n <= 0) return;
    if (count == 0) first_ns = t_ns;
    count += n;
  }

  /// Appends itself to `out` if it happened at all.
  /// `of`: out of how many, for what is suspicious when it is most.
  void append_to(std::vector<RejectionCount>& out, std::int64_t of = 0) const {
    if (count == 0) return;
    out.push_back({reason, count, time_text(first_ns), of});
  }
};

}  // namespace viwo
