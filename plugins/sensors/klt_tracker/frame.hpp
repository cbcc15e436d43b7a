// An image made ready for tracking: equalised, with its pyramid.
#pragma once

#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "tracker_options.hpp"
#include "viwo/api/measurement.hpp"

namespace viwo::klt {

struct Frame {
  /// As OpenCV's Lucas-Kanade takes it: level after level, each followed by its derivatives if
  /// there are any. Level 0 is the image itself.
  std::vector<cv::Mat> pyramid;
  bool has_derivatives = false;
  bool blank = true;  ///< too dark or too flat to see anything

  const cv::Mat& image() const { return pyramid.front(); }
};

/// Makes frames of one camera. One thread at a time; storage is used again.
class FrameMaker {
 public:
  explicit FrameMaker(const TrackerOptions& options);
  /// With derivatives, the frame can be tracked from; without, only into. A blank one gets no
  /// pyramid.
  void make(const Image& image, bool with_derivatives, Frame& out);

 private:
  TrackerOptions options_;
  cv::Ptr<cv::CLAHE> clahe_;
  cv::Mat equalised_;
};

/// Difference of the grey levels that 2 % of the pixels are below, and above.
int contrast(const Image& image);

}  // namespace viwo::klt
