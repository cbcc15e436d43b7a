#include "frame.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>

#include "flow.hpp"

namespace viwo::klt {
namespace {

/// Tiles of CLAHE, and its limit: mild, so that noise stays noise.
constexpr int kClaheTiles = 8;
constexpr double kClaheLimit = 2.;

/// A fraction of the pixels is enough for contrast and equalisation.
constexpr std::size_t kStride = 7;
constexpr std::int64_t kPercentile = 2;

/// Beyond the size of the window: what is sampled at once, and room to move.
constexpr int kMargin = 16;

/// Pixels of each grey level, of some of the image.
std::array<std::int64_t, 256> histogram(const Image& image) {
  std::array<std::int64_t, 256> counts{};
  for (std::size_t i = 0; i < image.pixels.size(); i += kStride) ++counts[image.pixels[i]];
  return counts;
}

/// Difference of the grey levels that 2 % of the pixels are below, and above.
int contrast(const std::array<std::int64_t, 256>& counts) {
  const std::int64_t n = std::accumulate(counts.begin(), counts.end(), std::int64_t{0});
  const std::int64_t tail = n * kPercentile / 100;
  int low = 0, high = 255;
  for (std::int64_t sum = 0; low < 255; ++low) {
    if ((sum += counts[static_cast<std::size_t>(low)]) > tail) break;
  }
  for (std::int64_t sum = 0; high > low; --high) {
    if ((sum += counts[static_cast<std::size_t>(high)]) > tail) break;
  }
  return high - low;
}

/// Makes all grey levels equally frequent, from the darkest one, which becomes black.
void equalise(const std::array<std::int64_t, 256>& counts, const cv::Mat& from, cv::Mat& to) {
  const auto darkest = std::find_if(counts.begin(), counts.end(), [](auto n) { return n > 0; });
  const std::int64_t n = std::accumulate(darkest + 1, counts.end(), std::int64_t{0});
  cv::Mat table = cv::Mat::zeros(1, 256, CV_8UC1);
  std::int64_t sum = 0;
  for (auto one = darkest + 1; one != counts.end(); ++one) {
    sum += *one;
    table.data[one - counts.begin()] = static_cast<std::uint8_t>((255 * sum + n / 2) / n);
  }
  cv::LUT(from, table, to);
}

void make_room(cv::Size size, int border, Level& level) {
  level.border = border;
  level.storage.create(size.height + 2 * border, size.width + 2 * border, CV_8UC1);
  level.image = level.storage(cv::Rect(cv::Point(border, border), size));
}

/// The level with its border; `grey` may be the part of it that is the image.
void fill(const cv::Mat& grey, Level& level) {
  const int b = level.border;
  cv::copyMakeBorder(grey, level.storage, b, b, b, b, cv::BORDER_REFLECT_101 | cv::BORDER_ISOLATED);
}

}  // namespace

FrameMaker::FrameMaker(const TrackerOptions& options) : options_(options) {
  if (options.histogram_method == Histogram::kClahe) {
    clahe_ = cv::createCLAHE(kClaheLimit, cv::Size(kClaheTiles, kClaheTiles));
  }
}

void FrameMaker::make(Frame& frame) {
  const auto counts = histogram(frame.pixels);
  frame.blank = contrast(counts) < options_.min_contrast;
  if (frame.blank) return;
  const cv::Mat pixels(frame.pixels.height_px, frame.pixels.width_px, CV_8UC1,
                       frame.pixels.pixels.data());
  switch (options_.histogram_method) {
    case Histogram::kNone:
      frame.image = pixels;
      break;
    case Histogram::kEqualize:
      equalise(counts, pixels, frame.image);
      break;
    case Histogram::kClahe:
      clahe_->apply(pixels, frame.image);
      break;
  }
  const auto n = static_cast<std::size_t>(options_.pyr_levels) + 1;
  const int border = options_.win_size + kMargin;
  frame.levels.resize(n);
  if (lowest_level(options_) == 0) {
    make_room(frame.image.size(), border, frame.levels[0]);
    fill(frame.image, frame.levels[0]);
  }
  for (std::size_t l = 1; l < n; ++l) {
    const cv::Mat& larger = l == 1 ? frame.image : frame.levels[l - 1].image;
    // A window must fit in.
    if (l > 1 && std::min(larger.cols, larger.rows) < 2 * options_.win_size) {
      frame.levels.resize(l);
      break;
    }
    Level& level = frame.levels[l];
    make_room(cv::Size((larger.cols + 1) / 2, (larger.rows + 1) / 2), border, level);
    cv::pyrDown(larger, level.image);
    fill(level.image, level);
  }
}

}  // namespace viwo::klt
