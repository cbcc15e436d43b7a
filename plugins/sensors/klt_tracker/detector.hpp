// Finds new points where an image lacks them: corners, spread over a grid of cells.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "frame.hpp"
#include "tracker_options.hpp"
#include "viwo/api/filter_view.hpp"

namespace viwo::klt {

/// Keeps points apart: says in constant time whether one is near another.
class Spacing {
 public:
  Spacing(cv::Size image, float distance_px);
  /// Whether all points added so far are at least the distance away.
  bool is_free(const cv::Point2f& uv) const;
  /// The same; then the point is added.
  bool add_if_free(const cv::Point2f& uv);
  void add(const cv::Point2f& uv);

 private:
  static constexpr int kNone = -1;
  struct Point {
    cv::Point2f uv;
    int next;  ///< of the same bucket
  };
  cv::Point bucket_of(const cv::Point2f& uv) const;
  int& first_of(const cv::Point& bucket);

  float distance_px_;
  int columns_;
  int rows_;
  std::vector<int> first_;  ///< point of each bucket
  std::vector<Point> points_;
};

class Detector {
 public:
  /// `mask`: 8 bit, of the size of the image, not 0 where no point may be; may be empty.
  Detector(const CameraView& camera, const TrackerOptions& options, cv::Mat mask);

  /// Appends points to `points` until each cell has its share, or there are num_pts: where the most
  /// are lacking first, and the last few not at all. `frame` is not blank. The same for any number
  /// of threads.
  void detect(const Frame& frame, std::vector<cv::Point2f>& points) const;

  /// The ray of a point that may be there: inside of the border, not masked, in the image of the
  /// lens.
  std::optional<Eigen::Vector3d> ray_at(const cv::Point2f& uv) const;
  bool inside(const cv::Point2f& uv) const;  ///< of the border

 private:
  struct Candidate {
    cv::Point2f uv;
    float score = 0.F;
  };
  /// A cell of the image that lacks points.
  struct Lacking {
    int cell = 0;
    int points = 0;
    std::vector<Candidate> found = {};  ///< the best first
    std::size_t next = 0;
    float best() const { return found.empty() ? 0.F : found.front().score; }
  };
  cv::Rect cell(int index) const;
  bool masked(const cv::Point& at) const;
  int cell_of(const cv::Point2f& uv) const;
  /// Cells that lack points, those that lack the most first.
  std::vector<Lacking> lacking_cells(const std::vector<cv::Point2f>& points) const;
  /// The best corners of a cell.
  void look_in(const Frame& frame, Lacking& lacking) const;
  /// Up to `wanted` of the corners that were found in some cells.
  static std::vector<cv::Point2f> choose(std::span<Lacking> cells, int wanted, Spacing& spacing);
  void refine(const Frame& frame, std::vector<cv::Point2f>& points) const;

  CameraView camera_;
  TrackerOptions options_;
  cv::Mat mask_;
  cv::Size size_;
  int per_cell_;  ///< share of a cell
};

}  // namespace viwo::klt
