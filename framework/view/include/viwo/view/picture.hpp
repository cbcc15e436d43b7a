// A colour picture in memory.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace viwo::view {

/// Pixels, 8 bit blue, green, red, row after row without padding.
struct Picture {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> bgr;  ///< 3 * width_px * height_px
};

/// The bytes of a PNG with exactly these pixels. std::invalid_argument for a picture without any.
std::string encode_png(const Picture& picture);

}  // namespace viwo::view
