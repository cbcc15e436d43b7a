#include "flow.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <Eigen/Core>
#include <Eigen/LU>

namespace viwo::klt {
namespace {

constexpr int kMaxSide = 64;
/// What is only a first guess for something better does not need more.
constexpr int kMaxGuessSteps = 8;
constexpr float kGuessStepPx = 0.1F;
constexpr int kMaxFlowSteps = 30;
constexpr float kFlowStepPx = 0.01F;
/// Of grey levels, their mean square; and of the gradient in its weakest direction, (grey levels /
/// px)^2: less is nothing to follow.
constexpr float kMinVariance = 0.25F;
constexpr float kMinGradient = 0.01F;

/// Columns are a multiple of what a processor takes at once.
struct WindowSize {
  int columns, rows;
  explicit WindowSize(int side) : columns((side + 7) / 8 * 8), rows(side) {}
  Eigen::Vector2f middle() const {
    return 0.5F * Eigen::Vector2f(static_cast<float>(columns - 1), static_cast<float>(rows - 1));
  }
};

using Window = std::array<float, static_cast<std::size_t>(kMaxSide* kMaxSide)>;
/// With a pixel more on each side, in rows that are eight longer.
using WideWindow = std::array<float, static_cast<std::size_t>((kMaxSide + 8) * (kMaxSide + 2))>;

/// Grey levels of a row between its pixels, `a` to the right of each.
void between_columns(const std::uint8_t* __restrict grey, float a, int columns,
                     float* __restrict out) {
  for (int i = 0; i < columns; ++i) {
    const auto left = static_cast<float>(grey[i]), right = static_cast<float>(grey[i + 1]);
    out[i] = left + a * (right - left);
  }
}

/// Grey levels between pixels of a window whose first pixel is at `corner`. False when it is not
/// within the image and its surroundings.
bool sample_window(const Level& level, const Eigen::Vector2f& corner, int columns, int rows,
                   float* __restrict out) {
  const float border = static_cast<float>(level.border);
  if (!(corner.minCoeff() >= -border &&
        corner.x() < static_cast<float>(level.image.cols - columns) + border - 1.F &&
        corner.y() < static_cast<float>(level.image.rows - rows) + border - 1.F)) {
    return false;
  }
  const float left = std::floor(corner.x()), top = std::floor(corner.y());
  const float a = corner.x() - left, b = corner.y() - top;
  const auto step = static_cast<std::ptrdiff_t>(level.image.step1());
  const std::uint8_t* grey = level.image.ptr() + static_cast<std::ptrdiff_t>(top) * step +
                             static_cast<std::ptrdiff_t>(left);
  std::array<std::array<float, kMaxSide + 8>, 2> between;
  float *above = between[0].data(), *below = between[1].data();
  between_columns(grey, a, columns, above);
  for (int row = 0; row < rows; ++row, out += columns) {
    grey += step;
    between_columns(grey, a, columns, below);
    for (int i = 0; i < columns; ++i) out[i] = above[i] + b * (below[i] - above[i]);
    std::swap(above, below);
  }
  return true;
}

/// What is followed: grey levels without their mean, their gradient, and sums of both, (KLT-3).
class Template {
 public:
  using Values = Eigen::Map<const Eigen::VectorXf, Eigen::Aligned32>;

  /// False when there is nothing to follow.
  bool take(const Level& level, const WindowSize& size, const Eigen::Vector2f& at) {
    size_ = size;
    count_ = size.columns * size.rows;
    alignas(32) WideWindow wide;
    const int stride = size.columns + 8;
    const Eigen::Vector2f corner = at - size.middle() - Eigen::Vector2f::Ones();
    if (!sample_window(level, corner, stride, size.rows + 2, wide.data())) return false;
    differentiate(wide.data(), stride);
    Eigen::Map<Eigen::VectorXf, Eigen::Aligned32> grey(grey_.data(), count_);
    grey.array() -= grey.mean();
    const float variance = grey.squaredNorm();
    const auto n = static_cast<float>(count_);
    if (!(variance > kMinVariance * n)) return false;
    norm_ = std::sqrt(variance);
    const Values gx = values(gx_), gy = values(gy_);
    mean_ = Eigen::Vector2f(gx.mean(), gy.mean());
    along_ = Eigen::Vector2f(gx.dot(grey), gy.dot(grey)) / norm_;
    // (KLT-4)
    Eigen::Matrix2f H;
    H << gx.squaredNorm(), gx.dot(gy), 0.F, gy.squaredNorm();
    H(1, 0) = H(0, 1);
    H -= n * mean_ * mean_.transpose() + along_ * along_.transpose();
    const float trace = H.trace(), determinant = H.determinant();
    if (!(determinant > kMinGradient * n * trace)) return false;  // nearly the weaker one
    H_inverse_ = H.inverse();
    return true;
  }

  /// By how much the place must be moved back so that it fits, (KLT-5) without deformation. The
  /// contrast of the image is that of the template: next to the place, T^T I is too small.
  Eigen::Vector2f step(const Window& image) const {
    const Values I = values(image);
    const float sum = I.sum(), like = I.dot(values(grey_)) / norm_;
    const float norm2 = I.squaredNorm() - sum * sum / static_cast<float>(count_);
    const Eigen::Vector2f b =
        Eigen::Vector2f(I.dot(values(gx_)), I.dot(values(gy_))) - sum * mean_ - like * along_;
    return H_inverse_ * b * (norm_ / std::sqrt(std::max(norm2, 1.F)));
  }

 private:
  Values values(const Window& window) const { return {window.data(), count_}; }

  void differentiate(const float* __restrict wide, int stride) {
    float* __restrict grey = grey_.data(), * __restrict gx = gx_.data(), * __restrict gy = gy_.data();
    for (int row = 0; row < size_.rows; ++row) {
      const float* above = wide + row * stride + 1;
      const float *at = above + stride, *below = at + stride;
      for (int i = 0; i < size_.columns; ++i) {
        grey[i] = at[i];
        gx[i] = 0.5F * (at[i + 1] - at[i - 1]);
        gy[i] = 0.5F * (below[i] - above[i]);
      }
      grey += size_.columns;
      gx += size_.columns;
      gy += size_.columns;
    }
  }

  WindowSize size_{0};
  int count_ = 0;
  alignas(32) Window grey_, gx_, gy_;
  float norm_ = 0.F;
  Eigen::Vector2f mean_, along_;  ///< of the gradient: its mean, and along the grey levels
  Eigen::Matrix2f H_inverse_;
};

}  // namespace

bool follow_window(const Frame& from, const Frame& to, const TrackerOptions& options, int highest,
                   const cv::Point2f& from_uv, cv::Point2f& uv) {
  const int lowest = lowest_level(options);
  const WindowSize size(options.win_size);
  Template window;
  alignas(32) Window image;
  Eigen::Vector2f u(uv.x, uv.y);
  for (int l = std::min(highest, from.highest_level()); l >= lowest; --l) {
    const auto level = static_cast<std::size_t>(l);
    const float scale = 1.F / static_cast<float>(1 << l);
    if (!window.take(from.levels[level], size, scale * Eigen::Vector2f(from_uv.x, from_uv.y))) {
      if (l == lowest) return false;
      continue;  // what is blurred here may be seen below
    }
    const int max_steps = l == 0 ? kMaxFlowSteps : kMaxGuessSteps;
    const float enough = l == 0 ? kFlowStepPx : kGuessStepPx;
    const Eigen::Vector2f begin = scale * u;
    Eigen::Vector2f at = begin;
    for (int k = 0; k < max_steps; ++k) {
      const Eigen::Vector2f corner = at - size.middle();
      if (!sample_window(to.levels[level], corner, size.columns, size.rows, image.data())) {
        return false;
      }
      const Eigen::Vector2f step = window.step(image);
      at -= step;
      if (!((at - begin).squaredNorm() < static_cast<float>(size.rows * size.rows))) return false;
      if (step.squaredNorm() < enough * enough) break;
    }
    u = at / scale;
  }
  uv = cv::Point2f(u.x(), u.y());
  return true;
}

}  // namespace viwo::klt
