#include "stereo_matcher.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include <Eigen/Geometry>

#include "parallel_for.hpp"
#include "viwo/camera/camera_model.hpp"

namespace viwo::klt {

double shared_view(const CameraView& left, const CameraView& right) {
  constexpr int kSteps = 16;
  const Eigen::Matrix3d R_LtoR = right.R_ItoC * left.R_ItoC.transpose();
  int seen = 0, shared = 0;
  for (int v = 0; v < kSteps; ++v) {
    for (int u = 0; u < kSteps; ++u) {
      const Eigen::Vector2d size(left.width_px - 1., left.height_px - 1.);
      const auto ray =
          unproject(left, size.cwiseProduct(Eigen::Vector2d(u + 0.5, v + 0.5)) / kSteps);
      if (!ray) continue;
      ++seen;
      Eigen::Vector2d uv;
      if (project(right, R_LtoR * *ray, uv) && in_image(right, uv)) ++shared;
    }
  }
  return seen > 0 ? static_cast<double>(shared) / seen : 0.;
}

StereoMatcher::StereoMatcher(const CameraView& left, const CameraView& right,
                             const TrackerOptions& options, cv::Mat mask)
    : options_(options),
      right_(right),
      detector_(right, options, std::move(mask)),
      R_LtoR_(right.R_ItoC * left.R_ItoC.transpose()),
      p_LinR_(right.p_IinC - R_LtoR_ * left.p_IinC),
      motion_{R_LtoR_, p_LinR_.normalized()},
      focal_px_(focal_px(right)) {}

bool StereoMatcher::guess(const Track& track, double per_m, cv::Point2f& uv) const {
  Eigen::Vector2d projected;
  if (!project(right_, R_LtoR_ * track.ray + per_m * p_LinR_, projected)) return false;
  uv = cv::Point2f(static_cast<float>(projected.x()), static_cast<float>(projected.y()));
  return detector_.inside(uv);
}

bool StereoMatcher::inverse_distance(const Eigen::Vector3d& ray_left,
                                     const Eigen::Vector3d& ray_right, double& per_m) const {
  const double limit = options_.stereo_threshold_px / focal_px_;
  if (epipolar_angle(motion_, ray_left, ray_right) > limit) return false;
  // (KLT-11)
  const Eigen::Vector3d a = ray_right.cross(R_LtoR_ * ray_left);
  const Eigen::Vector3d b = ray_right.cross(p_LinR_);
  per_m = -a.dot(b) / std::max(b.squaredNorm(), 1e-12);
  // A point at infinity comes out behind it half of the time; nothing is nearer than the baseline.
  return per_m * p_LinR_.norm() > -limit && per_m * p_LinR_.norm() < 1.;
}

bool StereoMatcher::find(const Frame& left, const Frame& right, const Track& track,
                         double expected_per_m, cv::Point2f& uv) const {
  const auto search = [&](double per_m, int highest) {
    if (!guess(track, per_m, uv)) return false;
    // The two cameras see nearly the same: what the left one has is the better first guess.
    Eigen::Matrix2f A = track.A;
    return find_track(track, left, right, options_, highest, uv, A);
  };
  if (expected_per_m >= 0. && search(expected_per_m, kLevelOfGuess)) return true;
  return search(std::max(track.inverse_distance_per_m, 0.), options_.pyr_levels);
}

void StereoMatcher::find_those(const Frame& left, const Frame& right,
                               const std::vector<Track>& tracks) {
  parallel_for(which_.size(), [&](std::size_t k) {
    const std::size_t i = which_[k];
    Match& match = matches_[i];
    if (!find(left, right, tracks[i], match.expected_per_m, match.to)) return;
    const auto ray = detector_.ray_at(match.to);
    match.found = ray.has_value();
    match.agrees = ray && inverse_distance(tracks[i].ray, *ray, match.per_m);
    match.per_m = match.agrees ? std::max(match.per_m, 0.) : -1.;
  });
}

void StereoMatcher::expect_new(const std::vector<Track>& tracks) {
  agreeing_.clear();
  for (const std::size_t i : which_) {
    if (matches_[i].agrees) agreeing_.add(tracks[i].uv, i);
  }
  which_.clear();
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (matches_[i].expected_per_m >= 0.) continue;
    which_.push_back(i);
    const auto near = agreeing_.nearest(tracks[i].uv);
    if (near) matches_[i].expected_per_m = median(*near, [&](auto k) { return matches_[k].per_m; });
  }
}

StereoCounts StereoMatcher::match(const Frame& left, const Frame& right, std::vector<Track>& tracks,
                                  std::vector<FeaturePoint>& points) {
  matches_.assign(tracks.size(), {});
  which_.clear();
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    matches_[i].expected_per_m = tracks[i].inverse_distance_per_m;
    if (tracks[i].inverse_distance_per_m >= 0.) which_.push_back(i);
  }
  find_those(left, right, tracks);
  expect_new(tracks);
  find_those(left, right, tracks);
  StereoCounts counts;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const Match& match = matches_[i];
    tracks[i].inverse_distance_per_m = match.per_m;
    if (match.found) ++counts.found;
    if (match.found && !match.agrees) ++counts.contradicting;
    if (match.agrees) points.push_back({tracks[i].id, match.to.x, match.to.y});
  }
  return counts;
}

}  // namespace viwo::klt
