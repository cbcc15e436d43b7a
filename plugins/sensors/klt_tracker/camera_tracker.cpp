#include "camera_tracker.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <opencv2/core/utility.hpp>
#include <opencv2/video/tracking.hpp>

#include "ray_ransac.hpp"
#include "viwo/camera/camera_model.hpp"

namespace viwo::klt {
namespace {

constexpr int kFlowSteps = 30;
constexpr double kFlowStepPx = 0.01;
/// A point that correlates less with what it was when it was found is another one, or hidden.
constexpr float kMinAlike = 0.7F;
constexpr float kMaxRefinePx = 3.F;

}  // namespace

void lucas_kanade(const Frame& from, const Frame& to, const TrackerOptions& options, int levels,
                  const std::vector<cv::Point2f>& from_points, std::vector<cv::Point2f>& to_points,
                  std::vector<std::uint8_t>& status, std::vector<float>& error) {
  cv::calcOpticalFlowPyrLK(
      from.pyramid, to.pyramid, from_points, to_points, status, error,
      cv::Size(options.win_size, options.win_size), levels,
      cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, kFlowSteps, kFlowStepPx),
      cv::OPTFLOW_USE_INITIAL_FLOW);
}

bool refine_point(const Patch& patch, const Frame& frame, cv::Point2f& uv, Eigen::Matrix2f& A) {
  const Eigen::Vector2f guess(uv.x, uv.y);
  PatchPose pose{guess, A};
  const float alike = patch.fit(frame.image(), pose);
  if (alike < kMinAlike || !((pose.u - guess).norm() < kMaxRefinePx)) return false;
  uv = cv::Point2f(pose.u.x(), pose.u.y());
  A = pose.A;
  return true;
}

CameraTracker::CameraTracker(const CameraView& camera, const TrackerOptions& options, cv::Mat mask,
                             std::uint64_t seed)
    : camera_(camera),
      options_(options),
      detector_(camera, options, std::move(mask)),
      seed_(seed),
      focal_px_(focal_px(camera)) {}

void CameraTracker::flow(const Frame& from, const Frame& to, double dt_s) {
  const std::size_t n = tracks_.size();
  old_.resize(n);
  now_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    old_[i] = tracks_[i].uv;
    const cv::Point2f predicted =
        old_[i] + tracks_[i].velocity_px_per_s * static_cast<float>(dt_s);  // (KLT-2)
    now_[i] = tracks_[i].has_velocity && detector_.usable(predicted) ? predicted : old_[i];
  }
  lucas_kanade(from, to, options_, options_.pyr_levels, old_, now_, status_, error_);

  // A camera that starts or stops turning: once more without prediction.
  std::vector<std::size_t> again;
  std::vector<cv::Point2f> starts;
  for (std::size_t i = 0; i < n; ++i) {
    if (status_[i] != 0 || !tracks_[i].has_velocity) continue;
    again.push_back(i);
    starts.push_back(old_[i]);
  }
  if (again.empty()) return;
  std::vector<cv::Point2f> ends = starts;
  lucas_kanade(from, to, options_, options_.pyr_levels, starts, ends, step_status_, error_);
  for (std::size_t k = 0; k < again.size(); ++k) {
    status_[again[k]] = step_status_[k];
    now_[again[k]] = ends[k];
  }
}

void CameraTracker::refine(const Frame& to) {
  const auto n = static_cast<int>(tracks_.size());
  cv::parallel_for_(cv::Range(0, n), [&](const cv::Range& range) {
    for (int k = range.start; k < range.end; ++k) {
      const auto i = static_cast<std::size_t>(k);
      if (status_[i] == 0 || tracks_[i].patch == nullptr) continue;
      if (!refine_point(*tracks_[i].patch, to, now_[i], tracks_[i].A)) status_[i] = 0;
    }
  });
}

void CameraTracker::check_epipolar() {
  std::vector<std::size_t> which;
  std::vector<Eigen::Vector3d> before, after;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (status_[i] == 0) continue;
    which.push_back(i);
    before.push_back(tracks_[i].ray);
    after.push_back(rays_[i]);
  }
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
    Track track = tracks_[i];
    track.velocity_px_per_s = (now_[i] - old_[i]) * static_cast<float>(1. / dt_s);
    track.has_velocity = true;
    track.uv = now_[i];
    track.ray = rays_[i];
    tracks_[kept++] = track;
  }
  tracks_.resize(kept);
}

void CameraTracker::follow(const Frame& from, const Frame& to, double dt_s) {
  ++images_;
  if (tracks_.empty()) return;
  flow(from, to, dt_s);
  if (options_.refine) refine(to);
  rays_.resize(tracks_.size());
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (status_[i] == 0) continue;
    if (!detector_.usable(now_[i])) {
      status_[i] = 0;
      continue;
    }
    rays_[i] = unproject(camera_, Eigen::Vector2d(now_[i].x, now_[i].y)).value();
  }
  if (options_.ransac) check_epipolar();
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
      track.patch =
          std::make_shared<Patch>(frame.image(), Eigen::Vector2f(points[i].x, points[i].y));
    }
    tracks_.push_back(track);
  }
}

}  // namespace viwo::klt
