// Loops over short arrays whose length is known at run time only, at the speed
// of fixed sizes.
#pragma once

#include <type_traits>

namespace viwo {

/// Calls f(first, width) for pieces that cover [0, n): widths of one wide
/// register as far as that goes, then 1. `width` is a std::integral_constant,
/// for Eigen's segment<decltype(width)::value>.
template <class F>
inline void in_pieces(int n, F&& f) {
  int first = 0;
  for (; first + 8 <= n; first += 8) f(first, std::integral_constant<int, 8>{});
  for (; first < n; ++first) f(first, std::integral_constant<int, 1>{});
}

}  // namespace viwo
