// Points of the left image in the right one.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "camera_tracker.hpp"
#include "detector.hpp"
#include "frame.hpp"
#include "neighbours.hpp"
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
  /// Looks for the tracks of `which_`, each first at what is expected of it.
  void find_those(const Frame& left, const Frame& right, const std::vector<Track>& tracks);
  /// New tracks, which become `which_`, are expected as far away as what is next to them.
  void expect_new(const std::vector<Track>& tracks);
  /// Where a point at this inverse distance is in the right image; false when it is not in it.
  bool guess(const Track& track, double per_m, cv::Point2f& uv) const;
  /// Where a point is in the right image, if it is; `expected` is its inverse distance, negative:
  /// not known.
  bool find(const Frame& left, const Frame& right, const Track& track, double expected_per_m,
            cv::Point2f& uv) const;
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
  /// What is known of a track in this pair.
  struct Match {
    double expected_per_m = -1.;
    cv::Point2f to;
    bool found = false;
    bool agrees = false;
    double per_m = -1.;  ///< where it agrees
  };
  // Storage is used again.
  std::vector<Match> matches_;  // per track
  std::vector<std::size_t> which_;
  Neighbours agreeing_;
};

}  // namespace viwo::klt
