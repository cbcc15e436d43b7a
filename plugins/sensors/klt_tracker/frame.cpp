#include "frame.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "flow.hpp"

namespace viwo::klt {
namespace {

/// Tiles of CLAHE, and its limit: mild, so that noise stays noise.
constexpr int kClaheTiles = 8;
constexpr double kClaheLimit = 2.;

/// A fraction of the pixels is enough for the contrast.
constexpr std::size_t kContrastStride = 29;
constexpr std::int64_t kPercentile = 2;

/// Beyond the size of the window: what is sampled at once, and room to move.
constexpr int kMargin = 16;

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

void FrameMaker::add_level(const cv::Mat& grey, Level& level) const {
  const int b = level.border = options_.win_size + kMargin;
  level.storage.create(grey.rows + 2 * b, grey.cols + 2 * b, CV_32FC1);
  level.image = level.storage(cv::Rect(b, b, grey.cols, grey.rows));
  grey.convertTo(level.image, CV_32F);
  // In place.
  cv::copyMakeBorder(level.image, level.storage, b, b, b, b,
                     cv::BORDER_REFLECT_101 | cv::BORDER_ISOLATED);
}

void FrameMaker::make(Frame& frame) {
  frame.blank = contrast(frame.pixels) < options_.min_contrast;
  if (frame.blank) return;
  const cv::Mat pixels(frame.pixels.height_px, frame.pixels.width_px, CV_8UC1,
                       frame.pixels.pixels.data());
  switch (options_.histogram_method) {
    case Histogram::kNone:
      frame.image = pixels;
      break;
    case Histogram::kEqualize:
      cv::equalizeHist(pixels, frame.image);
      break;
    case Histogram::kClahe:
      clahe_->apply(pixels, frame.image);
      break;
  }
  const auto n = static_cast<std::size_t>(options_.pyr_levels) + 1;
  frame.levels.resize(n);
  smaller_.resize(n);
  if (lowest_level(options_) == 0) add_level(frame.image, frame.levels[0]);
  for (std::size_t l = 1; l < n; ++l) {
    const cv::Mat& larger = l == 1 ? frame.image : smaller_[l - 1];
    // A window must fit in.
    if (l > 1 && std::min(larger.cols, larger.rows) < 2 * options_.win_size) {
      frame.levels.resize(l);
      break;
    }
    cv::pyrDown(larger, smaller_[l]);
    add_level(smaller_[l], frame.levels[l]);
  }
}

}  // namespace viwo::klt
