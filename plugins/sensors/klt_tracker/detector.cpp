#include "detector.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <utility>

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "parallel_for.hpp"
#include "viwo/camera/camera_model.hpp"

namespace viwo::klt {
namespace {

/// FAST looks at a circle of this radius.
constexpr int kFastRadius = 3;
/// Corners of a cell that are looked at more closely, per point that it may have: weaker ones are
/// soon lost.
constexpr int kCandidatesPerPoint = 8;
/// Half of the side of the window that a corner is scored in, px.
constexpr int kScoreRadius = 3;
/// Points that may be missing, as one part of so many, before cells that lack few of them are
/// looked at.
constexpr int kMissingParts = 50;
/// A corner has at least this mean square gradient in its weakest direction, (grey levels / px)^2:
/// above the noise of usual images.
constexpr float kMinScore = 4.F;
constexpr int kRefineRadius = 3;

/// Smaller eigenvalue of the mean structure tensor around a pixel, (KLT-1); gradients by Scharr.
float cornerness(const cv::Mat& image, const cv::Point& at) {
  std::int64_t xx = 0, xy = 0, yy = 0;
  for (int y = at.y - kScoreRadius; y <= at.y + kScoreRadius; ++y) {
    const std::uint8_t *above = image.ptr(y - 1), *row = image.ptr(y), *below = image.ptr(y + 1);
    for (int x = at.x - kScoreRadius; x <= at.x + kScoreRadius; ++x) {
      const int falling = below[x + 1] - above[x - 1], rising = above[x + 1] - below[x - 1];
      const int dx = 3 * (falling + rising) + 10 * (row[x + 1] - row[x - 1]);
      const int dy = 3 * (falling - rising) + 10 * (below[x] - above[x]);
      xx += dx * dx;
      xy += dx * dy;
      yy += dy * dy;
    }
  }
  constexpr float kSide = 2 * kScoreRadius + 1, kGain = 32.F;
  constexpr float kScale = 1.F / (kSide * kSide * kGain * kGain);
  const auto sum = static_cast<float>(xx + yy), difference = static_cast<float>(xx - yy);
  const auto product = static_cast<float>(2 * xy);
  return 0.5F * kScale * (sum - std::sqrt(difference * difference + product * product));
}

}  // namespace

Spacing::Spacing(cv::Size image, float distance_px)
    : distance_px_(std::max(distance_px, 1.F)),
      columns_(static_cast<int>(static_cast<float>(image.width) / distance_px_) + 1),
      rows_(static_cast<int>(static_cast<float>(image.height) / distance_px_) + 1),
      first_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), kNone) {}

cv::Point Spacing::bucket_of(const cv::Point2f& uv) const {
  return {std::clamp(static_cast<int>(uv.x / distance_px_), 0, columns_ - 1),
          std::clamp(static_cast<int>(uv.y / distance_px_), 0, rows_ - 1)};
}

int& Spacing::first_of(const cv::Point& bucket) {
  return first_[static_cast<std::size_t>(bucket.y) * static_cast<std::size_t>(columns_) +
                static_cast<std::size_t>(bucket.x)];
}

bool Spacing::is_free(const cv::Point2f& uv) const {
  const cv::Point at = bucket_of(uv);
  for (int r = std::max(at.y - 1, 0); r <= std::min(at.y + 1, rows_ - 1); ++r) {
    for (int c = std::max(at.x - 1, 0); c <= std::min(at.x + 1, columns_ - 1); ++c) {
      int i = first_[static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_) +
                     static_cast<std::size_t>(c)];
      for (; i != kNone; i = points_[static_cast<std::size_t>(i)].next) {
        const cv::Point2f apart = points_[static_cast<std::size_t>(i)].uv - uv;
        if (apart.dot(apart) < distance_px_ * distance_px_) return false;
      }
    }
  }
  return true;
}

bool Spacing::add_if_free(const cv::Point2f& uv) {
  if (!is_free(uv)) return false;
  add(uv);
  return true;
}

void Spacing::add(const cv::Point2f& uv) {
  int& first = first_of(bucket_of(uv));
  points_.push_back({uv, first});
  first = static_cast<int>(points_.size()) - 1;
}

Detector::Detector(const CameraView& camera, const TrackerOptions& options, cv::Mat mask)
    : camera_(camera),
      options_(options),
      mask_(std::move(mask)),
      size_(camera.width_px, camera.height_px),
      per_cell_((options.num_pts + options.grid_x * options.grid_y - 1) /
                (options.grid_x * options.grid_y)) {}

bool Detector::masked(const cv::Point& at) const {
  return !mask_.empty() && mask_.at<uchar>(at) != 0;
}

bool Detector::inside(const cv::Point2f& uv) const {
  const auto border = static_cast<float>(border_px(options_));
  return uv.x >= border && uv.y >= border && uv.x <= static_cast<float>(size_.width - 1) - border &&
         uv.y <= static_cast<float>(size_.height - 1) - border;
}

std::optional<Eigen::Vector3d> Detector::ray_at(const cv::Point2f& uv) const {
  if (!inside(uv) || masked({cvRound(uv.x), cvRound(uv.y)})) return std::nullopt;
  return unproject(camera_, Eigen::Vector2d(uv.x, uv.y));
}

cv::Rect Detector::cell(int index) const {
  const int column = index % options_.grid_x, row = index / options_.grid_x;
  const int x = column * size_.width / options_.grid_x;
  const int y = row * size_.height / options_.grid_y;
  return {cv::Point(x, y), cv::Point((column + 1) * size_.width / options_.grid_x,
                                     (row + 1) * size_.height / options_.grid_y)};
}

int Detector::cell_of(const cv::Point2f& uv) const {
  const auto part = [](float at, int size, int cells) {
    return std::clamp(static_cast<int>(at) * cells / size, 0, cells - 1);
  };
  return part(uv.y, size_.height, options_.grid_y) * options_.grid_x +
         part(uv.x, size_.width, options_.grid_x);
}

void Detector::look_in(const Frame& frame, Lacking& lacking) const {
  const int border = std::max(border_px(options_), std::max(kFastRadius, kScoreRadius));
  const cv::Rect inner(border, border, size_.width - 2 * border, size_.height - 2 * border);
  const cv::Rect wanted = cell(lacking.cell) & inner;
  if (wanted.empty()) return;
  // One pixel more than FAST needs, so that corners next to the edge of a cell have neighbours to
  // be compared with.
  const int margin = kFastRadius + 1;
  const cv::Rect seen = cv::Rect(wanted.x - margin, wanted.y - margin, wanted.width + 2 * margin,
                                 wanted.height + 2 * margin) &
                        cv::Rect(cv::Point(), size_);
  std::vector<cv::KeyPoint> corners;
  cv::FAST(frame.image(seen), corners, options_.fast_threshold, /*nonmaxSuppression=*/true);
  // First what is not wanted goes: it would take the places of weaker corners that are.
  const auto place = [&seen](const cv::KeyPoint& corner) {
    return cv::Point(cvRound(corner.pt.x) + seen.x, cvRound(corner.pt.y) + seen.y);
  };
  std::erase_if(corners, [&](const cv::KeyPoint& corner) {
    const cv::Point at = place(corner);
    return !wanted.contains(at) || masked(at);
  });
  const auto keep = static_cast<std::size_t>(kCandidatesPerPoint * per_cell_);
  if (corners.size() > keep) {
    std::nth_element(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(keep),
                     corners.end(), [](const cv::KeyPoint& a, const cv::KeyPoint& b) {
                       return std::tuple(-a.response, a.pt.y, a.pt.x) <
                              std::tuple(-b.response, b.pt.y, b.pt.x);
                     });
    corners.resize(keep);
  }
  std::vector<Candidate>& found = lacking.found;
  for (const cv::KeyPoint& corner : corners) {
    const cv::Point at = place(corner);
    const Candidate candidate{cv::Point2f(at), cornerness(frame.image, at)};
    if (candidate.score >= kMinScore && ray_at(candidate.uv)) found.push_back(candidate);
  }
  std::sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) {
    return std::tuple(-a.score, a.uv.y, a.uv.x) < std::tuple(-b.score, b.uv.y, b.uv.x);
  });
}

void Detector::refine(const Frame& frame, std::vector<cv::Point2f>& points) const {
  if (points.empty() || !options_.subpixel) return;
  std::vector<cv::Point2f> refined = points;
  cv::cornerSubPix(frame.image, refined, cv::Size(kRefineRadius, kRefineRadius), cv::Size(-1, -1),
                   cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 10, 0.01));
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (ray_at(refined[i])) points[i] = refined[i];
  }
}

std::vector<Detector::Lacking> Detector::lacking_cells(
    const std::vector<cv::Point2f>& points) const {
  std::vector<int> counts(static_cast<std::size_t>(options_.grid_x * options_.grid_y), 0);
  for (const cv::Point2f& uv : points) ++counts[static_cast<std::size_t>(cell_of(uv))];
  std::vector<Lacking> cells;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] < per_cell_) cells.push_back({static_cast<int>(i), per_cell_ - counts[i]});
  }
  std::stable_sort(cells.begin(), cells.end(),
                   [](const Lacking& a, const Lacking& b) { return a.points > b.points; });
  return cells;
}

std::vector<cv::Point2f> Detector::choose(std::span<Lacking> cells, int wanted, Spacing& spacing) {
  // One point of each cell after the other, beginning where the best ones are: the limit starves
  // the worst cells, and not the last ones of the image.
  std::sort(cells.begin(), cells.end(), [](const Lacking& a, const Lacking& b) {
    return std::tuple(-a.best(), a.cell) < std::tuple(-b.best(), b.cell);
  });
  std::vector<cv::Point2f> chosen;
  for (bool progress = true; progress;) {
    progress = false;
    for (Lacking& one : cells) {
      if (static_cast<int>(chosen.size()) == wanted) return chosen;
      if (one.points == 0) continue;
      while (one.next < one.found.size() && !spacing.add_if_free(one.found[one.next].uv)) {
        ++one.next;
      }
      if (one.next == one.found.size()) continue;
      chosen.push_back(one.found[one.next++].uv);
      --one.points;
      progress = true;
    }
  }
  return chosen;
}

void Detector::detect(const Frame& frame, std::vector<cv::Point2f>& points) const {
  Spacing spacing(size_, static_cast<float>(options_.min_px_dist));
  for (const cv::Point2f& uv : points) spacing.add(uv);  // tracks may be nearer to each other
  std::vector<Lacking> lacking = lacking_cells(points);
  int missing = options_.num_pts - static_cast<int>(points.size());
  std::vector<cv::Point2f> fresh;
  // As many cells at a time as should do, those that lack as much as the last of them included.
  for (std::span<Lacking> rest = lacking; !rest.empty() && missing > 0;) {
    const int enough = missing - options_.num_pts / kMissingParts;
    if (enough <= 0) break;
    std::size_t n = 0;
    for (int sum = 0; n < rest.size(); sum += rest[n++].points) {
      if (sum >= enough && rest[n].points < rest[n - 1].points) break;
    }
    const std::span<Lacking> cells = rest.first(n);
    rest = rest.subspan(n);
    parallel_for(n, [&](std::size_t i) { look_in(frame, cells[i]); });
    const std::vector<cv::Point2f> chosen = choose(cells, missing, spacing);
    missing -= static_cast<int>(chosen.size());
    fresh.insert(fresh.end(), chosen.begin(), chosen.end());
  }
  refine(frame, fresh);
  points.insert(points.end(), fresh.begin(), fresh.end());
}

}  // namespace viwo::klt
