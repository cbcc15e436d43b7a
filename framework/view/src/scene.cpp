// The parts of a picture and how it is put together.
#include "viwo/view/scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

#include "canvas.hpp"

namespace viwo::view {
namespace {

constexpr int kHeader = 30;
constexpr int kGap = 4;
constexpr int kCurveColumns = 4;

/// Largest part of `area` with the shape of an image of `size`, in its middle.
cv::Rect fitted(const cv::Rect& area, const cv::Size& size) {
  const double scale = std::min(static_cast<double>(area.width) / size.width,
                                static_cast<double>(area.height) / size.height);
  const int width = std::max(1, static_cast<int>(std::lround(scale * size.width)));
  const int height = std::max(1, static_cast<int>(std::lround(scale * size.height)));
  return {area.x + (area.width - width) / 2, area.y + (area.height - height) / 2, width, height};
}

/// `n` boxes in rows of `columns`.
std::vector<cv::Rect> grid(const cv::Rect& area, int n, int columns) {
  std::vector<cv::Rect> boxes;
  const int rows = (n + columns - 1) / columns;
  for (int i = 0; i < n; ++i) {
    const int width = area.width / columns, height = area.height / rows;
    boxes.emplace_back(area.x + (i % columns) * width, area.y + (i / columns) * height,
                       width - kGap, height - kGap);
  }
  return boxes;
}

void check(const Scene& scene, PictureSize size) {
  if (size.width_px < 320 || size.height_px < 240) {
    throw std::invalid_argument("view: a picture has at least 320 x 240 pixels");
  }
  for (const Curve& curve : scene.curves) {
    const std::size_t n = curve.x.size();
    if (curve.y.size() != n || curve.low.size() != n || curve.high.size() != n) {
      throw std::invalid_argument("view: sizes of the curve '" + curve.title + "' do not fit");
    }
  }
}

/// Ids of the points that are in more than one camera, in order.
std::vector<std::int64_t> ids_in_two(const std::vector<CameraImage>& cameras) {
  std::vector<std::int64_t> ids, twice;
  for (const CameraImage& camera : cameras) {
    for (const Track& track : camera.tracks) ids.push_back(track.id);
  }
  std::sort(ids.begin(), ids.end());
  for (std::size_t i = 1; i < ids.size(); ++i) {
    if (ids[i] == ids[i - 1]) twice.push_back(ids[i]);
  }
  return twice;
}

/// What the colours and rings of the points mean.
void draw_legend(cv::Mat& area) {
  constexpr int kBar = 120;
  const int y = area.rows / 2, right = area.cols - 6;
  put_text(area, "in two cameras", {right, y + 4}, kFaint, TextAt::kRight);
  cv::circle(area, {right - 112, y}, 5, kText, 1, cv::LINE_AA);
  const int bar = right - 128 - 76 - kBar;
  put_text(area, "tracked for 1", {bar - 6, y + 4}, kFaint, TextAt::kRight);
  for (int x = 0; x < kBar; ++x) {
    cv::line(area, {bar + x, y - 5}, {bar + x, y + 5},
             track_colour(1 + x * (kLongTrack - 1) / (kBar - 1)));
  }
  put_text(area, std::to_string(kLongTrack) + " images", {bar + kBar + 5, y + 4}, kFaint);
}

}  // namespace

bool has_pixels(const CameraImage& camera) {
  const Image* image = camera.pixels;
  return image != nullptr && image->width_px > 0 && image->height_px > 0 &&
         image->pixels.size() ==
             static_cast<std::size_t>(image->width_px) * static_cast<std::size_t>(image->height_px);
}

cv::Size image_size(const CameraImage& camera) {
  if (has_pixels(camera)) return {camera.pixels->width_px, camera.pixels->height_px};
  return {std::max(1, camera.width_px), std::max(1, camera.height_px)};
}

Layout layout_of(const Scene& scene, PictureSize size) {
  Layout layout;
  layout.header = {0, 0, size.width_px, kHeader};
  cv::Rect top(kGap, kHeader, size.width_px - kGap, size.height_px - kHeader);
  const int n_curves = static_cast<int>(scene.curves.size());
  if (n_curves > 0) {
    const int below = top.height * 2 / 5;
    top.height -= below;
    layout.curves = grid({top.x, top.y + top.height, top.width, below}, n_curves,
                         std::min(n_curves, kCurveColumns));
  }
  layout.trajectory = {top.x, top.y, top.width - kGap, top.height - kGap};
  const int n_cameras = static_cast<int>(scene.cameras.size());
  if (n_cameras == 0) return layout;
  const int width = std::min(size.width_px / 3, top.height);
  layout.trajectory = {top.x + top.width - width, top.y, width - kGap, top.height - kGap};
  top.width -= width;
  const auto boxes = grid(top, n_cameras, n_cameras <= 3 ? n_cameras : (n_cameras + 1) / 2);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    layout.cameras.push_back(fitted(boxes[i], image_size(scene.cameras[i])));
  }
  return layout;
}

void put_text(cv::Mat& area, const std::string& text, cv::Point at, const cv::Scalar& colour,
              TextAt side, double scale) {
  if (side == TextAt::kRight) {
    int below = 0;
    at.x -= cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, scale, 1, &below).width;
  }
  cv::putText(area, text, at, cv::FONT_HERSHEY_SIMPLEX, scale, colour, 1, cv::LINE_AA);
}

std::string number(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.3g", value);
  return text.data();
}

Picture draw(const Scene& scene, PictureSize size) {
  check(scene, size);
  Picture picture{size.width_px, size.height_px, {}};
  picture.bgr.resize(3 * static_cast<std::size_t>(size.width_px) *
                     static_cast<std::size_t>(size.height_px));
  cv::Mat canvas = as_mat(picture);
  canvas = kBackground;
  const Layout layout = layout_of(scene, size);
  cv::Mat header = canvas(layout.header);
  put_text(header, scene.status, {8, 20}, kText, TextAt::kLeft, 0.48);
  if (!scene.cameras.empty()) draw_legend(header);
  const auto in_two = ids_in_two(scene.cameras);
  for (std::size_t i = 0; i < layout.cameras.size(); ++i) {
    cv::Mat area = canvas(layout.cameras[i]);
    draw_camera(scene.cameras[i], in_two, area);
  }
  cv::Mat trajectory = canvas(layout.trajectory);
  draw_trajectory(scene, trajectory);
  for (std::size_t i = 0; i < layout.curves.size(); ++i) {
    cv::Mat area = canvas(layout.curves[i]);
    draw_curve(scene.curves[i], area);
  }
  return picture;
}

}  // namespace viwo::view
