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

class StereoMatcher {
 public:
  /// `mask` of the right camera, may be empty.
  StereoMatcher(const CameraView& left, const CameraView& right, const TrackerOptions& options,
                cv::Mat mask);

  /// Appends the points that agree with the extrinsics, with the ids of `tracks`, and keeps their
  /// distances there as first guesses for the next pair. `left` has derivatives; both not blank.
  StereoCounts match(const Frame& left, const Frame& right, std::vector<Track>& tracks,
                     std::vector<FeaturePoint>& points);

 private:
  /// Where a point is expected in the right image; false when it is not in it.
  bool guess(const Track& track, cv::Point2f& uv) const;
  /// To where the points look as they did when they were found.
  void refine(const Frame& right, std::vector<Track>& tracks);
  /// Inverse distance of a match, 1/m; false when the extrinsics contradict it.
  bool inverse_distance(const Eigen::Vector3d& ray_left, const cv::Point2f& uv_right,
                        double& per_m) const;

  TrackerOptions options_;
  CameraView right_;
  Detector detector_;
  Eigen::Matrix3d R_LtoR_;
  Eigen::Vector3d p_LinR_;
  RelativeMotion motion_;  ///< the same with a unit vector
  double focal_px_;
  std::vector<std::size_t> which_;
  std::vector<cv::Point2f> from_, to_;
  std::vector<std::uint8_t> status_;
  std::vector<float> error_;
};

}  // namespace viwo::klt
