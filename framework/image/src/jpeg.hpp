// JPEG files by libjpeg: what it makes up for data that are damaged is no image.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "image_header.hpp"
#include "viwo/api/measurement.hpp"

namespace viwo {

/// Decodes a JPEG, its brightness alone. Throws InputError for what is no JPEG, is not of this size
/// or has other than one or three colours, and for pixels that libjpeg had to guess: cut short,
/// bits that are no code.
void decode_jpeg(std::span<const std::uint8_t> bytes, ImageSize size, const std::string& name,
                 Image& out);

}  // namespace viwo
