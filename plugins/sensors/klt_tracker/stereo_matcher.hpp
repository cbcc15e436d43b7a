// Points of the left image in the right one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "camera_tracker.hpp"
#include "detector.hpp"
#include "frame.hpp"
#include "ray_ransac.hpp"
#include "tracker_options.hpp"
#include "viwo/api/filter_view.hpp"
#include "viwo/api/measurement.hpp"

namespace viwo::klt {

/// How many points were found in the right image, and how many of these cannot be there if the
/// extrinsics are right.
struct StereoCounts {
  std::size_t found = 0;
  std::size_t contradicting = 0;
};

/// Part of what `left` sees far away that is in the image of `right`, too, 0 .. 1.
double shared_view(const CameraView& left, const CameraView& right);

class StereoMatcher {
 public:
  /// `mask` of the right camera, may be empty.
  StereoMatcher(const CameraView& left, const CameraView& right, const TrackerOptions& options,
                cv::Mat mask);

  /// Appends the points that agree with the extrinsics, with the ids of `tracks`, and keeps their
  /// distances there as first guesses for the next pair. Both frames not blank.
  StereoCounts match(const Frame& left, const Frame& right, std::vector<Track>& tracks,
                     std::vector<FeaturePoint>& points);

 private:
  /// Where a point is expected in the right image; false when it is not in it.
  bool guess(const Track& track, cv::Point2f& uv) const;
  /// Where a point is in the right image, if it is.
  bool find(const Frame& left, const Frame& right, const Track& track, cv::Point2f& uv) const;
  /// Inverse distance of a match, 1/m; false when the extrinsics contradict it.
  bool inverse_distance(const Eigen::Vector3d& ray_left, const Eigen::Vector3d& ray_right,
                        double& per_m) const;

  TrackerOptions options_;
  CameraView right_;
  Detector detector_;
  Eigen::Matrix3d R_LtoR_;
  Eigen::Vector3d p_LinR_;
  RelativeMotion motion_;  ///< the same with a unit vector
  double focal_px_;
  // Per track; storage is used again.
  std::vector<cv::Point2f> to_;
  std::vector<std::uint8_t> found_;
};

}  // namespace viwo::klt
