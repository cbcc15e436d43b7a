#include "frame.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

#include <opencv2/video/tracking.hpp>

namespace viwo::klt {
namespace {

/// Tiles of CLAHE, and its limit: mild, so that noise stays noise.
constexpr int kClaheTiles = 8;
constexpr double kClaheLimit = 2.;

/// A fraction of the pixels is enough for the contrast.
constexpr std::size_t kContrastStride = 7;
constexpr std::int64_t kPercentile = 2;

}  // namespace

int contrast(const Image& image) {
  std::array<std::int64_t, 256> histogram{};
  std::int64_t n = 0;
  for (std::size_t i = 0; i < image.pixels.size(); i += kContrastStride, ++n) {
    ++histogram[image.pixels[i]];
  }
  const std::int64_t tail = n * kPercentile / 100;
  int low = 0, high = 255;
  for (std::int64_t sum = 0; low < 255; ++low) {
    if ((sum += histogram[static_cast<std::size_t>(low)]) > tail) break;
  }
  for (std::int64_t sum = 0; high > low; --high) {
    if ((sum += histogram[static_cast<std::size_t>(high)]) > tail) break;
  }
  return high - low;
}

FrameMaker::FrameMaker(const TrackerOptions& options) : options_(options) {
  if (options.histogram_method == Histogram::kClahe) {
    clahe_ = cv::createCLAHE(kClaheLimit, cv::Size(kClaheTiles, kClaheTiles));
  }
}

void FrameMaker::make(const Image& image, bool with_derivatives, Frame& out) {
  out.has_derivatives = with_derivatives;
  out.blank = contrast(image) < options_.min_contrast;
  if (out.blank) return;
  // OpenCV has no matrix of constant data; nothing writes to it.
  cv::Mat pixels(image.height_px, image.width_px, CV_8UC1,
                 const_cast<std::uint8_t*>(image.pixels.data()));
  switch (options_.histogram_method) {
    case Histogram::kNone:
      break;
    case Histogram::kEqualize:
      cv::equalizeHist(pixels, equalised_);
      pixels = equalised_;
      break;
    case Histogram::kClahe:
      clahe_->apply(pixels, equalised_);
      pixels = equalised_;
      break;
  }
  cv::buildOpticalFlowPyramid(pixels, out.pyramid, cv::Size(options_.win_size, options_.win_size),
                              options_.pyr_levels, with_derivatives, cv::BORDER_REFLECT_101,
                              cv::BORDER_CONSTANT, /*tryReuseInputImage=*/false);
}

}  // namespace viwo::klt
