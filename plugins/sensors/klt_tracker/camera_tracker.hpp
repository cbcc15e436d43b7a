// Points of one camera, followed from image to image.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "detector.hpp"
#include "frame.hpp"
#include "neighbours.hpp"
#include "patch.hpp"
#include "tracker_options.hpp"
#include "viwo/api/filter_view.hpp"
#include "viwo/math/mix.hpp"

namespace viwo::klt {

/// A point of the newest image.
struct Track {
  std::int64_t id = -1;                            ///< -1: new in this image
  cv::Point2f uv;                                  ///< px, as measured
  Eigen::Vector3d ray = Eigen::Vector3d::UnitZ();  ///< unit, in the camera
  cv::Point2f velocity_px_per_s;                   ///< between the last two images
  bool has_velocity = false;
  std::shared_ptr<const Patch> patch;               ///< as it was found; null without refinement
  Eigen::Matrix2f A = Eigen::Matrix2f::Identity();  ///< deformation since then
  double inverse_distance_per_m = -1.;  ///< along the ray, from stereo; negative: not known
};

/// For the draws of one camera of a sensor with `seed`: of no other camera and no other seed.
inline std::uint64_t camera_seed(std::uint64_t seed, std::size_t camera) {
  return mix64(mix64(seed) + camera);
}

class CameraTracker {
 public:
  CameraTracker(const CameraView& camera, const TrackerOptions& options, cv::Mat mask,
                std::uint64_t seed);

  /// Follows all points from one image to the next, `dt_s` later; what cannot be followed ends.
  /// Both frames not blank.
  void follow(const Frame& from, const Frame& to, double dt_s);
  /// Adds new points (id -1) where there are too few.
  void refill(const Frame& frame);
  void drop_all() { tracks_.clear(); }

  /// Older tracks first.
  std::vector<Track>& tracks() { return tracks_; }

 private:
  /// Looks for the tracks of `which_`; fills `status_`.
  void find_those(const Frame& from, const Frame& to, double dt_s);
  /// Where a point is in the next image, first near the predicted place; fills `now_` and `rays_`.
  bool find(const Frame& from, const Frame& to, double dt_s, std::size_t track);
  /// New tracks, which become `which_`, are expected to move as what is next to them did.
  void expect_new(double dt_s);
  void check_epipolar(double dt_s);
  /// The tracks that are left, at their new places.
  void keep(double dt_s);

  CameraView camera_;
  TrackerOptions options_;
  Detector detector_;
  std::uint64_t seed_;
  std::uint64_t images_ = 0;
  double focal_px_;
  std::vector<Track> tracks_;
  // Per track, while it is followed; storage is used again.
  std::vector<cv::Point2f> now_;
  std::vector<std::uint8_t> status_;
  std::vector<Eigen::Vector3d> rays_;
  std::vector<std::size_t> which_;
  Neighbours found_;
};

/// Looks for a track of `from` in another frame: Lucas-Kanade from level `highest` down, then, with
/// refinement, to where the point looks as it did when it was found. `uv` and `A` are the first
/// guesses and get the results; false when it is not there.
bool find_track(const Track& track, const Frame& from, const Frame& to,
                const TrackerOptions& options, int highest, cv::Point2f& uv, Eigen::Matrix2f& A);

/// Level that is high enough where a place is expected to within a few pixels.
inline constexpr int kLevelOfGuess = 2;

/// What an angle next to the axis is in pixels.
inline double focal_px(const CameraView& camera) {
  return 0.5 * (camera.intrinsics[0] + camera.intrinsics[1]);
}

}  // namespace viwo::klt
