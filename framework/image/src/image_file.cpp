#include "viwo/image/image_file.hpp"

#include <algorithm>
#include <fstream>
#include <string_view>
#include <system_error>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "grey_png.hpp"
#include "image_header.hpp"
#include "jpeg.hpp"
#include "viwo/api/status.hpp"

namespace viwo {
namespace {

/// Cameras have fewer: 7680 x 4320 fit. A file of some KB could ask for GB.
constexpr std::uint64_t kMostPixels = 1ULL << 25, kLongestSide = 1ULL << 15;
constexpr std::uint64_t kMostBytes = 1ULL << 28;

/// What a few bytes ask for is known before a pixel is decoded.
ImageSize size_of(std::span<const std::uint8_t> bytes, const std::string& name) {
  const auto size = image_size(bytes);
  if (!size) {
    throw InputError(name + ": is no PNG, JPEG, BMP, PGM or PPM, or its header is damaged");
  }
  const auto [width, height] = *size;
  if (width > 0 && height > 0 && width <= kLongestSide && height <= kLongestSide &&
      width * height <= kMostPixels) {
    return *size;
  }
  throw InputError(name + ": an image of " + std::to_string(width) + " x " +
                   std::to_string(height) + " pixels, at most " +
                   std::to_string(kMostPixels >> 20U) + " Mi are read");
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

}  // namespace

void decode_image(std::span<const std::uint8_t> bytes, const std::string& name, Image& out) {
  if (bytes.empty()) throw InputError(name + ": the image is empty");
  const bool is_png = begins(bytes, "\x89PNG");
  if (is_png && lacks_its_end(bytes)) throw InputError(name + ": the image is cut short");
  const ImageSize size = size_of(bytes, name);
  if (begins(bytes, "\xff\xd8")) {
    decode_jpeg(bytes, size, name, out);
    return;
  }
#if VIWO_HAS_LIBDEFLATE
  if (is_png && decode_grey_png(bytes, out)) return;
#endif
  std::vector<std::uint8_t> pixels_alone;
  if (is_png) bytes = pixels_alone = without_texts(bytes);
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

void read_image(const std::filesystem::path& file, Image& out) {
  const auto refuse = [&] {
    throw InputError(file.string() + ": the image is missing or cannot be read");
  };
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);  // also refuses folders
  if (error) refuse();
  if (size > kMostBytes) throw InputError(file.string() + ": is larger than an image is (256 MiB)");
  std::ifstream stream(file, std::ios::binary);
  std::vector<std::uint8_t> bytes(size);
  if (!stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size))) {
    refuse();
  }
  decode_image(bytes, file.string(), out);
}

}  // namespace viwo
