// From entries that are written each for itself, and often only when they change, to readings of
// all of them at one time.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "contents.hpp"
#include "pick.hpp"
#include "viwo/api/stamp_order.hpp"

namespace viwo::wpilog {

/// Numbers of one entry.
struct Source {
  const Entry* entry = nullptr;
  Pick pick;
};

struct ReadingOptions {
  const Entry* cycle =
      nullptr;  ///< a reading at each of its records; nullptr: where any source has one
  std::int64_t spread_us = 0;  ///< records of one cycle are no further apart
  double max_rejected_fraction = 0.;
};

/// Calls `visit` with the numbers of all sources, one source behind the other, for each reading, in
/// the order of their stamps; a number holds until the next one. Records that cannot be used, and
/// cycles before each source has a number, are counted by `order`; `visit` must have it accept the
/// stamps. All records of an entry have as many numbers as the first.
/// InputError when a record that is one of two of its entry within a cycle, with other numbers, is
/// no exception.
void for_each_reading(const Contents& contents, const std::vector<Source>& sources,
                      const ReadingOptions& options, StampOrder& order,
                      const std::function<void(std::int64_t t_ns, std::span<const double> numbers,
                                               const std::function<std::string()>& where)>& visit);

}  // namespace viwo::wpilog
