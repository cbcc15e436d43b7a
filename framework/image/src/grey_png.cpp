#include "grey_png.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <string_view>
#include <vector>

#include <libdeflate.h>

#include "png_rows.hpp"

namespace viwo {
namespace {

using Bytes = std::span<const std::uint8_t>;

/// Deflate makes no data smaller than one part of so many.
constexpr std::size_t kMaxRatio = 1032;

std::uint32_t big_endian(const std::uint8_t* at) {
  return std::uint32_t{at[0]} << 24 | std::uint32_t{at[1]} << 16 | std::uint32_t{at[2]} << 8 |
         std::uint32_t{at[3]};
}

/// Length, type, data, checksum of type and data.
struct Chunk {
  std::string_view type;
  Bytes data;
};

/// Takes the first chunk off; false when it is not whole.
bool take_chunk(Bytes& rest, Chunk& out) {
  constexpr std::size_t kAround = 12;
  if (rest.size() < kAround) return false;
  const std::size_t length = big_endian(rest.data());
  if (length > rest.size() - kAround) return false;
  const std::uint8_t* type = rest.data() + 4;
  if (libdeflate_crc32(0, type, 4 + length) != big_endian(type + 4 + length)) return false;
  out = {{reinterpret_cast<const char*>(type), 4}, rest.subspan(8, length)};
  rest = rest.subspan(kAround + length);
  return true;
}

struct Free {
  void operator()(libdeflate_decompressor* one) const { libdeflate_free_decompressor(one); }
};

/// Storage of a thread, used again.
struct Storage {
  std::unique_ptr<libdeflate_decompressor, Free> decompressor{libdeflate_alloc_decompressor()};
  std::vector<std::uint8_t> compressed, rows;
};

}  // namespace

bool decode_grey_png(Bytes bytes, Image& out) {
  constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  // Bits per pixel, kind of pixels, compression, filters, interlacing.
  constexpr std::array<std::uint8_t, 5> kGrey{8, 0, 0, 0, 0};
  if (bytes.size() < kMagic.size() || !std::equal(kMagic.begin(), kMagic.end(), bytes.begin())) {
    return false;
  }
  bytes = bytes.subspan(kMagic.size());
  Chunk chunk;
  if (!take_chunk(bytes, chunk) || chunk.type != "IHDR" || chunk.data.size() != 13 ||
      !std::equal(kGrey.begin(), kGrey.end(), chunk.data.begin() + 8)) {
    return false;
  }
  const std::size_t width = big_endian(chunk.data.data());
  const std::size_t height = big_endian(chunk.data.data() + 4);
  constexpr std::size_t kMaxSide = 1U << 20;  // OpenCV's
  if (width == 0 || height == 0 || width > kMaxSide || height > kMaxSide) return false;

  thread_local Storage storage;
  storage.compressed.clear();
  while (take_chunk(bytes, chunk) && chunk.type != "IEND") {
    if (chunk.type != "IDAT") continue;
    storage.compressed.insert(storage.compressed.end(), chunk.data.begin(), chunk.data.end());
  }
  const std::size_t size = height * (width + 1);  // each row begins with its filter
  if (chunk.type != "IEND" || size / kMaxRatio > storage.compressed.size()) return false;
  storage.rows.resize(size);
  if (storage.decompressor == nullptr ||
      libdeflate_zlib_decompress(storage.decompressor.get(), storage.compressed.data(),
                                 storage.compressed.size(), storage.rows.data(), size,
                                 nullptr) != LIBDEFLATE_SUCCESS) {
    return false;
  }
  out.width_px = static_cast<int>(width);
  out.height_px = static_cast<int>(height);
  out.pixels.resize(width * height);
  return restore_png_rows(storage.rows, width, out.pixels);
}

}  // namespace viwo
