// Rows of a grey PNG from the differences that its filters have left.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace viwo {

/// Restores an image of `width` > 0 pixels a row. `filtered` has, row after row, the filter and the
/// differences of `width` pixels; `pixels` gets the pixels. False for an unknown filter.
bool restore_png_rows(std::span<const std::uint8_t> filtered, std::size_t width,
                      std::span<std::uint8_t> pixels);

}  // namespace viwo
