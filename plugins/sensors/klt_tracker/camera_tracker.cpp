#include "camera_tracker.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "flow.hpp"
#include "parallel_for.hpp"
#include "ray_ransac.hpp"
#include "viwo/camera/camera_model.hpp"

namespace viwo::klt {
namespace {

/// A point that correlates less with what it was when it was found is another one, or hidden.
constexpr float kMinAlike = 0.7F;
/// One that does as much at once is not asked of Lucas-Kanade.
constexpr float kSurelyAlike = 0.9F;
constexpr float kMaxRefinePx = 3.F;

/// Fits the patch of a track from a first guess, which gets the result.
bool refine(const Track& track, const Frame& to, float least_alike, cv::Point2f& uv,
            Eigen::Matrix2f& A) {
  const Eigen::Vector2f guess(uv.x, uv.y);
  PatchPose pose{guess, A};
  const float alike = track.patch->fit(to.image, pose);
  if (alike < least_alike || !((pose.u - guess).norm() < kMaxRefinePx)) return false;
  uv = cv::Point2f(pose.u.x(), pose.u.y());
  A = pose.A;
  return true;
}

}  // namespace

bool find_track(const Track& track, const Frame& from, const Frame& to,
                const TrackerOptions& options, int highest, cv::Point2f& uv, Eigen::Matrix2f& A) {
  return follow_window(from, to, options, highest, track.uv, uv) &&
         (track.patch == nullptr || refine(track, to, kMinAlike, uv, A));
}

CameraTracker::CameraTracker(const CameraView& camera, const TrackerOptions& options, cv::Mat mask,
                             std::uint64_t seed)
    : camera_(camera),
      options_(options),
      detector_(camera, options, std::move(mask)),
      seed_(seed),
      focal_px_(focal_px(camera)) {}

bool CameraTracker::find(const Frame& from, const Frame& to, double dt_s, std::size_t i) {
  Track& track = tracks_[i];
  const auto look = [&](const cv::Point2f& guess, const auto& finds) {
    now_[i] = guess;
    Eigen::Matrix2f A = track.A;
    if (!finds(now_[i], A)) return false;
    const auto ray = detector_.ray_at(now_[i]);
    if (!ray) return false;
    rays_[i] = *ray;
    track.A = A;
    return true;
  };
  const auto search = [&](const cv::Point2f& guess, int highest) {
    return look(guess, [&](cv::Point2f& uv, Eigen::Matrix2f& A) {
      return find_track(track, from, to, options_, highest, uv, A);
    });
  };
  const auto fits = [&](const cv::Point2f& guess) {
    return track.patch != nullptr && look(guess, [&](cv::Point2f& uv, Eigen::Matrix2f& A) {
             return refine(track, to, kSurelyAlike, uv, A);
           });
  };
  if (track.has_velocity) {
    const cv::Point2f predicted =
        track.uv + track.velocity_px_per_s * static_cast<float>(dt_s);  // (KLT-2)
    if (detector_.inside(predicted) && (fits(predicted) || search(predicted, kLevelOfGuess))) {
      return true;
    }
  }
  // New, or a camera that starts or stops turning.
  return search(track.uv, options_.pyr_levels);
}

void CameraTracker::check_epipolar(double dt_s) {
  std::vector<std::size_t> which;
  std::vector<Eigen::Vector3d> before, after;
  std::vector<double> rows_1, rows_2;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (status_[i] == 0) continue;
    which.push_back(i);
    before.push_back(tracks_[i].ray);
    after.push_back(rays_[i]);
    rows_1.push_back(camera_.after_middle_s(tracks_[i].uv.y));
    rows_2.push_back(camera_.after_middle_s(now_[i].y));
  }
  if (camera_.line_delay_s > 0.) straighten(before, after, rows_1, rows_2, dt_s);
  const auto flags =
      epipolar_inliers(before, after, options_.ransac_threshold_px / focal_px_, seed_ + images_);
  for (std::size_t k = 0; k < which.size(); ++k) status_[which[k]] = flags[k];
}

void CameraTracker::keep(double dt_s) {
  // Two tracks that have come together are one point.
  Spacing spacing(cv::Size(camera_.width_px, camera_.height_px),
                  0.5F * static_cast<float>(options_.min_px_dist));
  std::size_t kept = 0;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (status_[i] == 0 || !spacing.add_if_free(now_[i])) continue;
    Track track = std::move(tracks_[i]);
    track.velocity_px_per_s = (now_[i] - track.uv) * static_cast<float>(1. / dt_s);
    track.has_velocity = true;
    track.uv = now_[i];
    track.ray = rays_[i];
    tracks_[kept++] = std::move(track);
  }
  tracks_.resize(kept);
}

void CameraTracker::find_those(const Frame& from, const Frame& to, double dt_s) {
  parallel_for(which_.size(), [&](std::size_t k) {
    const std::size_t i = which_[k];
    status_[i] = find(from, to, dt_s, i) ? 1 : 0;
  });
}

void CameraTracker::expect_new(double dt_s) {
  found_.clear();
  for (const std::size_t i : which_) {
    if (status_[i] != 0) found_.add(tracks_[i].uv, i);
  }
  which_.clear();
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    Track& track = tracks_[i];
    if (track.has_velocity) continue;
    which_.push_back(i);
    const auto near = found_.nearest(track.uv);
    if (!near) continue;
    const cv::Point2f step(median(*near, [&](auto k) { return now_[k].x - tracks_[k].uv.x; }),
                           median(*near, [&](auto k) { return now_[k].y - tracks_[k].uv.y; }));
    track.velocity_px_per_s = step * static_cast<float>(1. / dt_s);
    track.has_velocity = true;
  }
}

void CameraTracker::follow(const Frame& from, const Frame& to, double dt_s) {
  ++images_;
  if (tracks_.empty()) return;
  const std::size_t n = tracks_.size();
  now_.resize(n);
  rays_.resize(n);
  status_.assign(n, 0);
  which_.clear();
  for (std::size_t i = 0; i < n; ++i) {
    if (tracks_[i].has_velocity) which_.push_back(i);
  }
  find_those(from, to, dt_s);
  expect_new(dt_s);
  find_those(from, to, dt_s);
  if (options_.ransac) check_epipolar(dt_s);
  keep(dt_s);
}

void CameraTracker::refill(const Frame& frame) {
  std::vector<cv::Point2f> points;
  for (const Track& track : tracks_) points.push_back(track.uv);
  const std::size_t before = points.size();
  detector_.detect(frame, points);
  for (std::size_t i = before; i < points.size(); ++i) {
    Track track;
    track.uv = points[i];
    track.ray = unproject(camera_, Eigen::Vector2d(points[i].x, points[i].y)).value();
    if (options_.refine) {
      track.patch = std::make_shared<Patch>(frame.image, Eigen::Vector2f(points[i].x, points[i].y));
    }
    tracks_.push_back(track);
  }
}

}  // namespace viwo::klt
