// By itself: who only writes images does not need what reads all their formats.
#include <cstddef>
#include <fstream>
#include <stdexcept>

#include <png.h>

#include "viwo/image/image_file.hpp"

namespace viwo {

std::vector<std::uint8_t> encode_png(std::span<const std::uint8_t> pixels, int width_px,
                                     int height_px, PngColours colours) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(width_px);
  png.height = static_cast<png_uint_32>(height_px);
  png.format = colours == PngColours::kBgr ? PNG_FORMAT_BGR : PNG_FORMAT_GRAY;
  // Simulated images are noisy, and hardly any smaller with more effort.
  png.flags = PNG_IMAGE_FLAG_FAST;
  if (pixels.size() < PNG_IMAGE_SIZE(png)) throw std::invalid_argument("png: pixels are missing");
  std::vector<std::uint8_t> bytes(PNG_IMAGE_PNG_SIZE_MAX(png));
  png_alloc_size_t size = bytes.size();
  if (png_image_write_to_memory(&png, bytes.data(), &size, 0, pixels.data(), 0, nullptr) == 0) {
    throw std::runtime_error(std::string("png: ") + png.message);
  }
  bytes.resize(size);
  return bytes;
}

std::vector<std::uint8_t> encode_png(const Image& image) {
  return encode_png(image.pixels, image.width_px, image.height_px, PngColours::kGrey);
}

void write_png(const std::filesystem::path& file, const Image& image) {
  const std::vector<std::uint8_t> bytes = encode_png(image);
  std::ofstream stream(file, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  stream.close();
  if (!stream) throw std::runtime_error("cannot write " + file.string());
}

}  // namespace viwo
