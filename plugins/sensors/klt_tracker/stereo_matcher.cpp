#include "stereo_matcher.hpp"

#include <algorithm>
#include <utility>

#include <Eigen/Geometry>
#include <opencv2/core/utility.hpp>

#include "viwo/camera/camera_model.hpp"

namespace viwo::klt {

StereoMatcher::StereoMatcher(const CameraView& left, const CameraView& right,
                             const TrackerOptions& options, cv::Mat mask)
    : options_(options),
      right_(right),
      detector_(right, options, std::move(mask)),
      R_LtoR_(right.R_ItoC * left.R_ItoC.transpose()),
      p_LinR_(right.p_IinC - R_LtoR_ * left.p_IinC),
      motion_{R_LtoR_, p_LinR_.normalized()},
      focal_px_(focal_px(right)) {}

bool StereoMatcher::guess(const Track& track, cv::Point2f& uv) const {
  const double per_m = std::max(track.inverse_distance_per_m, 0.);
  Eigen::Vector2d projected;
  if (!project(right_, R_LtoR_ * track.ray + per_m * p_LinR_, projected)) return false;
  uv = cv::Point2f(static_cast<float>(projected.x()), static_cast<float>(projected.y()));
  return detector_.usable(uv);
}

bool StereoMatcher::inverse_distance(const Eigen::Vector3d& ray_left, const cv::Point2f& uv_right,
                                     double& per_m) const {
  const auto ray_right = unproject(right_, Eigen::Vector2d(uv_right.x, uv_right.y));
  if (!ray_right) return false;
  const double limit = options_.stereo_threshold_px / focal_px_;
  if (epipolar_angle(motion_, ray_left, *ray_right) > limit) return false;
  // (KLT-11)
  const Eigen::Vector3d a = ray_right->cross(R_LtoR_ * ray_left);
  const Eigen::Vector3d b = ray_right->cross(p_LinR_);
  per_m = -a.dot(b) / std::max(b.squaredNorm(), 1e-12);
  // A point at infinity comes out behind it half of the time; nothing is nearer than the baseline.
  return per_m * p_LinR_.norm() > -limit && per_m * p_LinR_.norm() < 1.;
}

void StereoMatcher::refine(const Frame& right, std::vector<Track>& tracks) {
  cv::parallel_for_(cv::Range(0, static_cast<int>(which_.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      const auto k = static_cast<std::size_t>(i);
      Track& track = tracks[which_[k]];
      if (status_[k] == 0 || track.patch == nullptr) continue;
      // The two cameras see nearly the same: what the left one has is the better first guess.
      Eigen::Matrix2f A = track.A;
      if (!refine_point(*track.patch, right, to_[k], A)) status_[k] = 0;
    }
  });
}

StereoCounts StereoMatcher::match(const Frame& left, const Frame& right, std::vector<Track>& tracks,
                                  std::vector<FeaturePoint>& points) {
  which_.clear();
  from_.clear();
  to_.clear();
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    cv::Point2f uv;
    if (!guess(tracks[i], uv)) {
      tracks[i].inverse_distance_per_m = -1.;
      continue;
    }
    which_.push_back(i);
    from_.push_back(tracks[i].uv);
    to_.push_back(uv);
  }
  StereoCounts counts;
  if (which_.empty()) return counts;
  lucas_kanade(left, right, options_, options_.pyr_levels, from_, to_, status_, error_);
  refine(right, tracks);
  for (std::size_t k = 0; k < which_.size(); ++k) {
    Track& track = tracks[which_[k]];
    double per_m = -1.;
    const bool found = status_[k] != 0 && detector_.usable(to_[k]);
    const bool agrees = found && inverse_distance(track.ray, to_[k], per_m);
    track.inverse_distance_per_m = agrees ? std::max(per_m, 0.) : -1.;
    if (found) ++counts.found;
    if (found && !agrees) ++counts.contradicting;
    if (agrees) points.push_back({track.id, to_[k].x, to_[k].y});
  }
  return counts;
}

}  // namespace viwo::klt
