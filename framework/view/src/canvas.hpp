// Where things are in a picture, its colours, and the helpers to draw.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "viwo/view/scene.hpp"

namespace viwo::view {

// Blue, green, red.
inline const cv::Scalar kBackground(28, 24, 22);
inline const cv::Scalar kDarkField(48, 42, 38);
inline const cv::Scalar kText(235, 235, 235);
inline const cv::Scalar kFaint(150, 140, 130);
inline const cv::Scalar kFrame(80, 72, 66);
inline const cv::Scalar kEstimate(60, 170, 255);
inline const cv::Scalar kReference(190, 180, 170);
inline const cv::Scalar kBand(110, 78, 40);

/// The pixels of a picture, not copied.
inline cv::Mat as_mat(const Picture& picture) {
  // OpenCV has no matrix of constant pixels; nobody writes to this one but draw().
  return {picture.height_px, picture.width_px, CV_8UC3,
          const_cast<std::uint8_t*>(picture.bgr.data())};
}

/// The parts of a picture; a part without content is empty.
struct Layout {
  cv::Rect header;
  std::vector<cv::Rect> cameras;  ///< where the image of each camera is, to scale
  cv::Rect trajectory;
  std::vector<cv::Rect> curves;
};
Layout layout_of(const Scene& scene, PictureSize size);

/// Whether there are pixels, all of them.
bool has_pixels(const CameraImage& camera);
/// Of the image of a camera: that of its pixels, if there are any.
cv::Size image_size(const CameraImage& camera);

/// Of a point that has been seen in so many images in a row; the last one from kLongTrack on.
cv::Scalar track_colour(int images);

inline constexpr double kTextScale = 0.42;
enum class TextAt { kLeft, kRight };  ///< end of the text that `x` is at
/// `x`, `y`: of the base line.
void put_text(cv::Mat& area, const std::string& text, cv::Point at, const cv::Scalar& colour,
              TextAt side = TextAt::kLeft, double scale = kTextScale);

/// With three digits.
std::string number(double value);

// `area` is the part of the picture to draw in.
void draw_camera(const CameraImage& camera, const std::vector<std::int64_t>& in_two_cameras,
                 cv::Mat& area);
void draw_trajectory(const Scene& scene, cv::Mat& area);
void draw_curve(const Curve& curve, cv::Mat& area);

}  // namespace viwo::view
