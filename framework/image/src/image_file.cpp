#include "viwo/image/image_file.hpp"

#include <algorithm>
#include <string_view>
#include <system_error>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "grey_png.hpp"
#include "image_header.hpp"
#include "jpeg.hpp"
#include "viwo/api/status.hpp"
#include "viwo/config/regular_file.hpp"

namespace viwo {
namespace {

constexpr std::uint64_t kMostBytes = 1ULL << 28;

/// What a few bytes ask for is known before a pixel is decoded.
ImageSize size_of(std::span<const std::uint8_t> bytes, const std::string& name) {
  const auto size = image_size(bytes);
  if (!size) {
    throw InputError(name + ": is no PNG, JPEG, BMP, PGM or PPM, or its header is damaged");
  }
  const auto [width, height] = *size;
  if (width > 0 && height > 0 && width <= kLongestImageSide && height <= kLongestImageSide &&
      width * height <= kMostImagePixels) {
    return *size;
  }
  throw InputError(name + ": an image of " + std::to_string(width) + " x " +
                   std::to_string(height) + " pixels, at most " +
                   std::to_string(kMostImagePixels >> 20U) + " Mi are read");
}

/// OpenCV decodes what it finds of a PNG that was cut short and leaves the rest black: look at the
/// end.
bool lacks_its_end(std::span<const std::uint8_t> png) {
  // Some writers pad the file: with zeros to the end of a block, or with a few bytes of anything.
  const auto last = std::find_if(png.rbegin(), png.rend(), [](auto byte) { return byte != 0; });
  const auto whole = png.first(static_cast<std::size_t>(png.rend() - last));
  const auto tail = whole.last(std::min<std::size_t>(whole.size(), 64));
  constexpr std::string_view kMark = "IEND";
  const auto same = [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); };
  return std::search(tail.begin(), tail.end(), kMark.begin(), kMark.end(), same) == tail.end();
}

bool is_png(std::span<const std::uint8_t> bytes) { return begins(bytes, "\x89PNG"); }

/// Of what is whole, as far as that shows without its pixels.
ImageSize size_of_whole(std::span<const std::uint8_t> bytes, const std::string& name) {
  if (bytes.empty()) throw InputError(name + ": the image is empty");
  if (is_png(bytes) && lacks_its_end(bytes)) throw InputError(name + ": the image is cut short");
  return size_of(bytes, name);
}

void decode(std::span<const std::uint8_t> bytes, const ImageSize& size, const std::string& name,
            Image& out) {
  if (begins(bytes, "\xff\xd8")) {
    decode_jpeg(bytes, size, name, out);
    return;
  }
#if VIWO_HAS_LIBDEFLATE
  if (is_png(bytes) && decode_grey_png(bytes, out)) return;
#endif
  std::vector<std::uint8_t> pixels_alone;
  if (is_png(bytes)) bytes = pixels_alone = needed_for_pixels(bytes);
  const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8UC1,
                    const_cast<std::uint8_t*>(bytes.data()));
  cv::Mat grey;
  try {
    // As the sensor gave it: turned by what EXIF says, it would not be that of the calibration.
    grey = cv::imdecode(raw, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception& error) {
    throw InputError(name + ": " + error.err);
  }
  if (grey.empty()) throw InputError(name + ": not an image that OpenCV can read");
  out.width_px = grey.cols;
  out.height_px = grey.rows;
  out.pixels.assign(grey.datastart, grey.dataend);
}

std::vector<std::uint8_t> bytes_of(const std::filesystem::path& file) {
  try {
    config::RegularFile opened(file);
    const std::uintmax_t size = opened.size();
    if (size > kMostBytes) {
      throw InputError(file.string() + ": is larger than an image is (256 MiB)");
    }
    std::vector<std::uint8_t> bytes(size);
    if (opened.read({reinterpret_cast<char*>(bytes.data()), bytes.size()}) == size) return bytes;
  } catch (const std::system_error&) {  // as if it had become shorter
  }
  throw InputError(file.string() + ": the image is missing or cannot be read");
}

}  // namespace

void decode_image(std::span<const std::uint8_t> bytes, const std::string& name, Image& out) {
  decode(bytes, size_of_whole(bytes, name), name, out);
}

void decode_image_of_size(std::span<const std::uint8_t> bytes, const std::string& name,
                          int width_px, int height_px, Image& out) {
  const ImageSize size = size_of_whole(bytes, name);
  out.width_px = static_cast<int>(size.width_px);
  out.height_px = static_cast<int>(size.height_px);
  out.pixels.clear();
  if (out.width_px == width_px && out.height_px == height_px) decode(bytes, size, name, out);
}

void read_image(const std::filesystem::path& file, Image& out) {
  decode_image(bytes_of(file), file.string(), out);
}

void read_image_of_size(const std::filesystem::path& file, int width_px, int height_px,
                        Image& out) {
  decode_image_of_size(bytes_of(file), file.string(), width_px, height_px, out);
}

}  // namespace viwo
