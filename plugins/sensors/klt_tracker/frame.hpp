// An image made ready for tracking: equalised, with its pyramid. Detection, following and
// refinement share it.
#pragma once

#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "tracker_options.hpp"
#include "viwo/api/measurement.hpp"

namespace viwo::klt {

/// 8 bit, each level half as large as the one before.
struct Level {
  cv::Mat image;
  int border = 0;   ///< pixels beyond each edge that are there, too: the image mirrored
  cv::Mat storage;  ///< the image with its border
};

struct Frame {
  Image pixels;       ///< as they come
  cv::Mat image;      ///< 8 bit, equalised; the pixels themselves if nothing is to be done
  bool blank = true;  ///< too dark or too flat to see anything
  /// By level. Level 0 is empty when nothing is followed there (lowest_level() in flow.hpp).
  std::vector<Level> levels;

  int highest_level() const { return static_cast<int>(levels.size()) - 1; }
};

/// Makes frames of one camera. One thread at a time; storage is used again.
class FrameMaker {
 public:
  explicit FrameMaker(const TrackerOptions& options);
  /// The rest of a frame whose pixels are there. A blank one gets no levels.
  void make(Frame& frame);

 private:
  TrackerOptions options_;
  cv::Ptr<cv::CLAHE> clahe_;
};

}  // namespace viwo::klt
