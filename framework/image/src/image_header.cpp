#include "image_header.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdlib>
#include <string_view>

namespace viwo {
namespace {

using Bytes = std::span<const std::uint8_t>;

std::uint64_t big_endian(Bytes bytes) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8U | byte;
  return value;
}

std::uint64_t little_endian(Bytes bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8U | bytes[i];
  return value;
}

std::optional<ImageSize> png_size(Bytes bytes) {
  if (bytes.size() < 24 || !begins(bytes.subspan(12), "IHDR")) return std::nullopt;
  return ImageSize{big_endian(bytes.subspan(16, 4)), big_endian(bytes.subspan(20, 4))};
}

/// In the first segment that begins a frame. libjpeg looks on behind what is no segment, and is
/// asked for the same size (decode_jpeg()).
std::optional<ImageSize> jpeg_size(Bytes bytes) {
  constexpr std::uint8_t kTables = 0xc4, kExtension = 0xc8, kArithmetic = 0xcc, kScan = 0xda;
  std::size_t at = 2;
  while (at + 9 <= bytes.size()) {
    const std::uint8_t kind = bytes[at + 1];
    if (bytes[at] != 0xff || kind == kScan) return std::nullopt;
    if (kind == 0xff || (kind >= 0xd0 && kind <= 0xd7) || kind == 0x01) {  // fill, no segment
      at += kind == 0xff ? 1 : 2;
      continue;
    }
    if (kind >= 0xc0 && kind <= 0xcf && kind != kTables && kind != kExtension &&
        kind != kArithmetic) {
      return ImageSize{big_endian(bytes.subspan(at + 7, 2)), big_endian(bytes.subspan(at + 5, 2))};
    }
    at += 2 + static_cast<std::size_t>(big_endian(bytes.subspan(at + 2, 2)));
  }
  return std::nullopt;
}

std::optional<ImageSize> bmp_size(Bytes bytes) {
  if (bytes.size() < 26) return std::nullopt;
  constexpr std::uint64_t kOldHeader = 12;
  if (little_endian(bytes.subspan(14, 4)) == kOldHeader) {
    return ImageSize{little_endian(bytes.subspan(18, 2)), little_endian(bytes.subspan(20, 2))};
  }
  const auto height = static_cast<std::int32_t>(little_endian(bytes.subspan(22, 4)));
  return ImageSize{little_endian(bytes.subspan(18, 4)),  // rows from the top: a negative number
                   static_cast<std::uint64_t>(std::abs(std::int64_t{height}))};
}

/// "P5 # a comment\n 640 480 255". Without the space OpenCV hands it to decoders of other formats,
/// which nobody has asked for.
std::optional<ImageSize> netpbm_size(Bytes bytes) {
  constexpr std::size_t kMostDigits = 9;
  std::size_t at = 2;
  if (bytes.size() <= at || std::isspace(bytes[at]) == 0) return std::nullopt;
  const auto number = [&]() -> std::optional<std::uint64_t> {
    bool is_comment = false;
    for (; at < bytes.size() && (is_comment || bytes[at] < '0' || bytes[at] > '9'); ++at) {
      if (bytes[at] == '#') is_comment = true;
      if (bytes[at] == '\n' || bytes[at] == '\r') is_comment = false;
    }
    std::uint64_t value = 0;
    std::size_t digits = 0;
    for (; at < bytes.size() && bytes[at] >= '0' && bytes[at] <= '9'; ++at) {
      if (++digits > kMostDigits) return std::nullopt;
      value = 10 * value + (bytes[at] - '0');
    }
    if (digits == 0) return std::nullopt;
    return value;
  };
  const auto width = number();
  const auto height = number();
  if (!width || !height) return std::nullopt;
  return ImageSize{*width, *height};
}

/// Whether what begins with the type of a chunk of a PNG changes pixels: those that libpng must
/// know, or refuses; transparency; and by what powers colours are, before they are added to grey.
bool is_needed(Bytes type) {
  constexpr std::uint8_t kIsAncillary = 0x20;
  return (type[0] & kIsAncillary) == 0 || begins(type, "tRNS") || begins(type, "gAMA") ||
         begins(type, "sRGB");
}

}  // namespace

bool begins(Bytes bytes, std::string_view magic) {
  return bytes.size() >= magic.size() &&
         std::equal(magic.begin(), magic.end(), bytes.begin(),
                    [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; });
}

std::optional<ImageSize> image_size(Bytes bytes) {
  if (begins(bytes, "\x89PNG\r\n\x1a\n")) return png_size(bytes);
  if (begins(bytes, "\xff\xd8\xff")) return jpeg_size(bytes);
  if (begins(bytes, "BM")) return bmp_size(bytes);
  for (const char* const magic : {"P2", "P3", "P5", "P6"}) {
    if (begins(bytes, magic)) return netpbm_size(bytes);
  }
  return std::nullopt;
}

std::vector<std::uint8_t> needed_for_pixels(Bytes png) {
  constexpr std::size_t kMagic = 8, kAround = 12;  // length, type and checksum of a chunk
  std::vector<std::uint8_t> out;
  const auto take = [&](std::size_t n) {
    out.insert(out.end(), png.begin(), png.begin() + static_cast<std::ptrdiff_t>(n));
    png = png.subspan(n);
  };
  take(std::min(kMagic, png.size()));
  while (png.size() >= kAround) {
    const std::uint64_t length = big_endian(png.first(4));
    const Bytes type = png.subspan(4);
    if (length > png.size() - kAround) {
      // libpng asks for the memory of a chunk before it looks whether that is there.
      if (!begins(type, "IDAT")) png = {};
      break;
    }
    const std::size_t size = kAround + static_cast<std::size_t>(length);
    if (is_needed(type)) {
      take(size);
    } else {
      png = png.subspan(size);
    }
  }
  take(png.size());
  return out;
}

}  // namespace viwo
