// Loops over short arrays whose length is known at run time only, at the speed
// of fixed sizes.
#pragma once

#include <type_traits>

#include <Eigen/Core>

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

/// Calls f with the size of the noise blocks known at compile time, if it is a usual one, else with
/// Eigen::Dynamic.
template <class F>
inline void with_block_size(int size, F&& f) {
  if (size == 1) return f(std::integral_constant<int, 1>{});
  if (size == 2) return f(std::integral_constant<int, 2>{});
  f(std::integral_constant<int, Eigen::Dynamic>{});
}

}  // namespace viwo
