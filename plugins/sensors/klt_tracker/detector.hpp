// Finds new points where an image lacks them: corners, spread over a grid of cells.
#pragma once

#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include "frame.hpp"
#include "tracker_options.hpp"
#include "viwo/api/filter_view.hpp"

namespace viwo::klt {

/// Keeps points apart: says in constant time whether one is near another.
class Spacing {
 public:
  Spacing(cv::Size image, float distance_px);
  /// Whether all points added so far are at least the distance away; then the point is added.
  bool add_if_free(const cv::Point2f& uv);

 private:
  float distance_px_;
  int columns_;
  int rows_;
  std::vector<std::vector<cv::Point2f>> buckets_;
};

class Detector {
 public:
  /// `mask`: 8 bit, of the size of the image, not 0 where no point may be; may be empty.
  Detector(const CameraView& camera, const TrackerOptions& options, cv::Mat mask);

  /// Appends points to `points` until each cell has its share, or there are num_pts. `frame` has
  /// derivatives and is not blank. The same for any number of threads.
  void detect(const Frame& frame, std::vector<cv::Point2f>& points) const;

  /// Whether a point may be there: inside of the border, not masked, in the image of the lens.
  bool usable(const cv::Point2f& uv) const;

 private:
  struct Candidate {
    cv::Point2f uv;
    float score = 0.F;
  };
  cv::Rect cell(int index) const;
  bool masked(const cv::Point& at) const;
  int cell_of(const cv::Point2f& uv) const;
  /// Corners of a cell, the best first.
  std::vector<Candidate> candidates(const Frame& frame, const cv::Rect& cell) const;
  void refine(const Frame& frame, std::vector<cv::Point2f>& points) const;

  CameraView camera_;
  TrackerOptions options_;
  cv::Mat mask_;
  cv::Size size_;
  int per_cell_;  ///< share of a cell
};

}  // namespace viwo::klt
