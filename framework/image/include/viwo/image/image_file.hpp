// Image files: JPEG read by libjpeg, others by OpenCV, to grey images; PNG written by libpng.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "viwo/api/measurement.hpp"

namespace viwo {

/// Cameras have fewer: 7680 x 4320 fit. A file of some KB could ask for GB.
inline constexpr std::uint64_t kMostImagePixels = 1ULL << 25, kLongestImageSide = 1ULL << 15;

/// Decodes a PNG, JPEG, BMP, PGM or PPM that is in memory. Colours become grey, 16 bit become the
/// upper 8; rows and columns stay as they are, whatever EXIF says of the orientation.
/// InputError when it is none, is cut short or damaged (a JPEG: where its pixels would be guessed),
/// or says to have more than 2^25 pixels (then before any is decoded); `name` says where it comes
/// from.
void decode_image(std::span<const std::uint8_t> bytes, const std::string& name, Image& out);

/// As ImageSource::read_of_size(): of an image of another size nothing is decoded.
void decode_image_of_size(std::span<const std::uint8_t> bytes, const std::string& name,
                          int width_px, int height_px, Image& out);

/// Reads an image file of at most 256 MiB. InputError when it is missing, or as for decode_image().
void read_image(const std::filesystem::path& file, Image& out);
void read_image_of_size(const std::filesystem::path& file, int width_px, int height_px, Image& out);

enum class PngColours { kGrey, kBgr };  ///< 1 byte a pixel, or 3: blue, green, red

/// The bytes of a PNG with exactly these pixels, row after row without padding.
std::vector<std::uint8_t> encode_png(std::span<const std::uint8_t> pixels, int width_px,
                                     int height_px, PngColours colours);
std::vector<std::uint8_t> encode_png(const Image& image);

/// Writes a PNG with exactly these pixels. std::runtime_error when it cannot be written.
void write_png(const std::filesystem::path& file, const Image& image);

/// An image that is a file.
class ImageFile final : public ImageSource {
 public:
  explicit ImageFile(std::filesystem::path file) : file_(std::move(file)) {}
  void read(Image& out) const override { read_image(file_, out); }
  void read_of_size(int width_px, int height_px, Image& out) const override {
    read_image_of_size(file_, width_px, height_px, out);
  }

 private:
  std::filesystem::path file_;
};

/// An image that is in memory.
class ImageInMemory final : public ImageSource {
 public:
  explicit ImageInMemory(Image image) : image_(std::move(image)) {}
  void read(Image& out) const override { out = image_; }

 private:
  Image image_;
};

}  // namespace viwo
