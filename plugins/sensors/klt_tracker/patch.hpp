// What a point looked like when it was found, and where that is in a later image, up to an affine
// deformation and to brightness: so that errors do not add up from image to image (model.md).
#pragma once

#include <array>
#include <cstddef>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace viwo::klt {

/// From the pixels around a point when it was found to those around it now: x_now = u + A x.
struct PatchPose {
  Eigen::Vector2f u = Eigen::Vector2f::Zero();      ///< px
  Eigen::Matrix2f A = Eigen::Matrix2f::Identity();  ///< deformation
};

class Patch {
 public:
  /// `image` is 8 bit; the window around `u` must be inside of it.
  Patch(const cv::Mat& image, const Eigen::Vector2f& u);
  /// Moves `pose` to where the patch fits best, from a first guess within about two pixels.
  /// Returns how alike the image is there, the correlation coefficient: 1 for equal up to
  /// brightness and contrast. -1 if it left the image, or does not come to rest.
  float fit(const cv::Mat& image, PatchPose& pose) const;

 private:
  static constexpr int kRadius = 6;
  static constexpr int kSide = 2 * kRadius + 1;
  static constexpr int kPixels = kSide * kSide;
  /// Filled up with zeros to what a processor takes at once.
  static constexpr int kFilled = (kPixels + 15) / 16 * 16;
  using Pixels = Eigen::Matrix<float, kFilled, 1>;
  using Offsets = std::array<float, static_cast<std::size_t>(kFilled)>;

  /// Pixels row after row, as seen from the middle.
  static Offsets offsets(bool along_x);
  static bool sample(const cv::Mat& image, const PatchPose& pose, Pixels& out);

  Pixels T_;                                ///< grey levels, mean 0 and norm 1
  Eigen::Matrix<float, kFilled, 6> steps_;  ///< of the deformation and of the place, per grey level
};

}  // namespace viwo::klt
