// Grey PNG files, the usual ones of recordings, by libdeflate: half the time that libpng takes.
#pragma once

#include <cstdint>
#include <span>

#include "viwo/api/measurement.hpp"

namespace viwo {

/// Decodes a PNG of 8 bit grey without interlacing. False, with anything in `out`, for any other
/// image and for whatever is not as it should be: OpenCV decodes that, or says what is wrong.
bool decode_grey_png(std::span<const std::uint8_t> bytes, Image& out);

}  // namespace viwo
