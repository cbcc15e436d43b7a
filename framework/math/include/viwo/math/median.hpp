// The median of a list in one pass.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace viwo {

/// The value in the middle; of an even number, the larger of the two in the middle. Of at least one
/// value; they are reordered.
template <class T>
T upper_median(std::vector<T>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace viwo
