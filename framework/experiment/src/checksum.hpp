// Whether two pieces of data are the same, in four bytes.
#pragma once

#include <cstdint>
#include <string_view>

#include <zlib.h>

namespace viwo::experiment {

/// CRC-32 of `bytes` behind those of which `before` is the checksum.
inline std::uint32_t crc_of(std::string_view bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace viwo::experiment
