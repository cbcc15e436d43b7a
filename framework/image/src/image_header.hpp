// What the first bytes of an image file say, before any pixel is decoded.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace viwo {

struct ImageSize {
  std::uint64_t width_px = 0;
  std::uint64_t height_px = 0;
};

/// Whether a file begins as its kind does.
bool begins(std::span<const std::uint8_t> bytes, std::string_view magic);

/// Of a PNG, JPEG, BMP, PGM or PPM; nothing for other formats, and for a header that is broken.
std::optional<ImageSize> image_size(std::span<const std::uint8_t> bytes);

/// A PNG without what changes no pixel. Texts, profiles and palettes that are proposed are
/// decompressed by libpng, up to 8 MB of a few KB, and all kept; and what it does not like of them
/// it prints by the name that they have, whatever bytes that is.
std::vector<std::uint8_t> needed_for_pixels(std::span<const std::uint8_t> png);

}  // namespace viwo
