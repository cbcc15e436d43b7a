// The image of a camera with its tracks.
#include <algorithm>
#include <array>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "canvas.hpp"

namespace viwo::view {
namespace {

/// Pixels of a camera's image to pixels of the area that shows it.
class Projection {
 public:
  Projection(const cv::Size& image, const cv::Mat& area)
      : image_(image),
        x_(static_cast<double>(area.cols) / image.width),
        y_(static_cast<double>(area.rows) / image.height) {}

  bool inside(const TrailPoint& p) const {  // false for what is not finite
    return p.u_px > -0.5 && p.v_px > -0.5 && p.u_px < image_.width - 0.5 &&
           p.v_px < image_.height - 0.5;
  }
  /// The middle of a pixel is at a whole number, in both images.
  cv::Point operator()(const TrailPoint& p) const {
    return {static_cast<int>(std::lround((p.u_px + 0.5) * x_ - 0.5)),
            static_cast<int>(std::lround((p.v_px + 0.5) * y_ - 0.5))};
  }

 private:
  cv::Size image_;
  double x_, y_;
};

bool draw_pixels(const CameraImage& camera, cv::Mat& area) {
  if (!has_pixels(camera)) return false;
  const Image* image = camera.pixels;
  const cv::Mat grey(image->height_px, image->width_px, CV_8UC1,
                     const_cast<std::uint8_t*>(image->pixels.data()));
  cv::Mat scaled;
  const bool smaller = area.cols < grey.cols;
  cv::resize(grey, scaled, area.size(), 0., 0., smaller ? cv::INTER_AREA : cv::INTER_LINEAR);
  cv::cvtColor(scaled, area, cv::COLOR_GRAY2BGR);
  return true;
}

void draw_track(const Track& track, bool in_two, const Projection& projection, cv::Mat& area) {
  const cv::Scalar colour = track_colour(track.images);
  for (std::size_t i = 1; i < track.trail.size(); ++i) {
    const TrailPoint &from = track.trail[i - 1], &to = track.trail[i];
    if (!projection.inside(from) || !projection.inside(to)) continue;
    cv::line(area, projection(from), projection(to), colour, 1, cv::LINE_AA);
  }
  if (track.trail.empty() || !projection.inside(track.trail.back())) return;
  const cv::Point at = projection(track.trail.back());
  cv::circle(area, at, 2, colour, cv::FILLED, cv::LINE_AA);
  if (in_two) cv::circle(area, at, 5, kText, 1, cv::LINE_AA);
}

}  // namespace

cv::Scalar track_colour(int images) {
  // New ones blue, then green, yellow, red.
  static const std::array<cv::Scalar, 4> kColours{cv::Scalar(255, 150, 60), cv::Scalar(90, 230, 80),
                                                  cv::Scalar(40, 230, 250),
                                                  cv::Scalar(60, 60, 255)};
  const double part = std::clamp((images - 1.) / (kLongTrack - 1.), 0., 1.) * 3.;
  const auto i = std::min<std::size_t>(2, static_cast<std::size_t>(part));
  const double t = part - static_cast<double>(i);
  return kColours[i] * (1. - t) + kColours[i + 1] * t;
}

void draw_camera(const CameraImage& camera, const std::vector<std::int64_t>& in_two_cameras,
                 cv::Mat& area) {
  if (!draw_pixels(camera, area)) area = kDarkField;
  const Projection projection(image_size(camera), area);
  for (const Track& track : camera.tracks) {
    const bool in_two = std::binary_search(in_two_cameras.begin(), in_two_cameras.end(), track.id);
    draw_track(track, in_two, projection, area);
  }
  std::string text = camera.name + ": " + std::to_string(camera.tracks.size()) + " points";
  if (!camera.note.empty()) text += " (" + camera.note + ")";
  // Readable on any image.
  int below = 0;
  const int width = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, kTextScale, 1, &below).width;
  cv::rectangle(area, {0, 0}, {width + 10, 21}, kBackground, cv::FILLED);
  put_text(area, text, {6, 16}, kText);
}

}  // namespace viwo::view
