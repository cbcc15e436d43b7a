// What sensors, updates and others left out, as tests compare it.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include "viwo/api/rejections.hpp"

namespace viwo::testing {

/// Of anything that has rejections(), of a Rejections, or of the list that they give.
template <class T>
std::vector<RejectionCount> all_rejections(const T& source) {
  if constexpr (std::is_same_v<T, std::vector<RejectionCount>>) {
    return source;
  } else if constexpr (std::is_same_v<T, Rejections>) {
    return source.counts();
  } else if constexpr (requires { source.rejections(); }) {
    return source.rejections();
  } else {
    std::vector<RejectionCount> all;
    source.rejections(all);
    return all;
  }
}

/// "reason | count | first", one each.
template <class T>
std::vector<std::string> rejections_of(const T& source) {
  std::vector<std::string> lines;
  for (const RejectionCount& r : all_rejections(source)) {
    lines.push_back(r.reason + " | " + std::to_string(r.count) + " | " + r.first);
  }
  return lines;
}

using Counts = std::map<std::string, std::int64_t>;

/// How often, by reason.
template <class T>
Counts counts_of(const T& source) {
  Counts counts;
  for (const RejectionCount& r : all_rejections(source)) counts[r.reason] += r.count;
  return counts;
}

}  // namespace viwo::testing
