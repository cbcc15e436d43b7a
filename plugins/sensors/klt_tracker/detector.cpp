#include "detector.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <utility>

#include <opencv2/core/utility.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "viwo/camera/camera_model.hpp"

namespace viwo::klt {
namespace {

/// FAST looks at a circle of this radius.
constexpr int kFastRadius = 3;
/// Corners of a cell that are looked at more closely, per point that may be taken.
constexpr int kCandidatesPerPoint = 8;
/// Half of the side of the window that a corner is scored in, px.
constexpr int kScoreRadius = 3;
/// Gain of the derivatives in a pyramid: grey levels per pixel times this.
constexpr float kDerivativeGain = 32.F;
/// A corner has at least this mean square gradient in its weakest direction, (grey levels / px)^2:
/// above the noise of usual images.
constexpr float kMinScore = 4.F;
constexpr int kRefineRadius = 3;

/// Smaller eigenvalue of the mean structure tensor around a pixel, (KLT-1).
float cornerness(const cv::Mat& derivatives, const cv::Point& at) {
  float xx = 0.F, xy = 0.F, yy = 0.F;
  for (int y = at.y - kScoreRadius; y <= at.y + kScoreRadius; ++y) {
    const auto* row = derivatives.ptr<cv::Vec2s>(y);
    for (int x = at.x - kScoreRadius; x <= at.x + kScoreRadius; ++x) {
      const auto dx = static_cast<float>(row[x][0]), dy = static_cast<float>(row[x][1]);
      xx += dx * dx;
      xy += dx * dy;
      yy += dy * dy;
    }
  }
  constexpr float kSide = 2 * kScoreRadius + 1;
  constexpr float kScale = 1.F / (kSide * kSide * kDerivativeGain * kDerivativeGain);
  const float difference = xx - yy;
  return 0.5F * kScale * (xx + yy - std::sqrt(difference * difference + 4.F * xy * xy));
}

}  // namespace

Spacing::Spacing(cv::Size image, float distance_px)
    : distance_px_(std::max(distance_px, 1.F)),
      columns_(static_cast<int>(static_cast<float>(image.width) / distance_px_) + 1),
      rows_(static_cast<int>(static_cast<float>(image.height) / distance_px_) + 1),
      buckets_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

bool Spacing::add_if_free(const cv::Point2f& uv) {
  const int column = std::clamp(static_cast<int>(uv.x / distance_px_), 0, columns_ - 1);
  const int row = std::clamp(static_cast<int>(uv.y / distance_px_), 0, rows_ - 1);
  const auto bucket = [this](int r, int c) -> std::vector<cv::Point2f>& {
    return buckets_[static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_) +
                    static_cast<std::size_t>(c)];
  };
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows_ - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns_ - 1); ++c) {
      for (const cv::Point2f& other : bucket(r, c)) {
        if ((other - uv).dot(other - uv) < distance_px_ * distance_px_) return false;
      }
    }
  }
  bucket(row, column).push_back(uv);
  return true;
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

bool Detector::usable(const cv::Point2f& uv) const {
  const auto border = static_cast<float>(border_px(options_));
  if (!(uv.x >= border && uv.y >= border && uv.x <= static_cast<float>(size_.width - 1) - border &&
        uv.y <= static_cast<float>(size_.height - 1) - border)) {
    return false;
  }
  if (masked({cvRound(uv.x), cvRound(uv.y)})) return false;
  return unproject(camera_, Eigen::Vector2d(uv.x, uv.y)).has_value();
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

std::vector<Detector::Candidate> Detector::candidates(const Frame& frame,
                                                      const cv::Rect& cell) const {
  const int border = std::max(border_px(options_), std::max(kFastRadius, kScoreRadius));
  const cv::Rect inner(border, border, size_.width - 2 * border, size_.height - 2 * border);
  const cv::Rect wanted = cell & inner;
  std::vector<Candidate> found;
  if (wanted.empty()) return found;
  // One pixel more than FAST needs, so that corners next to the edge of a cell have neighbours to
  // be compared with.
  const int margin = kFastRadius + 1;
  const cv::Rect seen = cv::Rect(wanted.x - margin, wanted.y - margin, wanted.width + 2 * margin,
                                 wanted.height + 2 * margin) &
                        cv::Rect(cv::Point(), size_);
  std::vector<cv::KeyPoint> corners;
  cv::FAST(frame.image()(seen), corners, options_.fast_threshold, /*nonmaxSuppression=*/true);
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
  for (const cv::KeyPoint& corner : corners) {
    const cv::Point at = place(corner);
    const Candidate candidate{cv::Point2f(at), cornerness(frame.pyramid[1], at)};
    if (candidate.score >= kMinScore && usable(candidate.uv)) found.push_back(candidate);
  }
  std::sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) {
    return std::tuple(-a.score, a.uv.y, a.uv.x) < std::tuple(-b.score, b.uv.y, b.uv.x);
  });
  return found;
}

void Detector::refine(const Frame& frame, std::vector<cv::Point2f>& points) const {
  if (points.empty() || !options_.subpixel) return;
  std::vector<cv::Point2f> refined = points;
  cv::cornerSubPix(frame.image(), refined, cv::Size(kRefineRadius, kRefineRadius), cv::Size(-1, -1),
                   cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 10, 0.01));
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (usable(refined[i])) points[i] = refined[i];
  }
}

void Detector::detect(const Frame& frame, std::vector<cv::Point2f>& points) const {
  const int n_cells = options_.grid_x * options_.grid_y;
  Spacing spacing(size_, static_cast<float>(options_.min_px_dist));
  std::vector<int> counts(static_cast<std::size_t>(n_cells), 0);
  for (const cv::Point2f& uv : points) {
    spacing.add_if_free(uv);
    ++counts[static_cast<std::size_t>(cell_of(uv))];
  }
  auto total = static_cast<int>(points.size());
  struct Lacking {
    int cell = 0;
    std::vector<Candidate> found = {};
    std::size_t next = 0;
    float best() const { return found.empty() ? 0.F : found.front().score; }
  };
  std::vector<Lacking> lacking;
  for (int i = 0; i < n_cells; ++i) {
    if (counts[static_cast<std::size_t>(i)] < per_cell_) lacking.push_back({i});
  }
  if (lacking.empty() || total >= options_.num_pts) return;

  cv::parallel_for_(cv::Range(0, static_cast<int>(lacking.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      Lacking& one = lacking[static_cast<std::size_t>(i)];
      one.found = candidates(frame, cell(one.cell));
    }
  });
  // One point of each cell after the other, beginning where the best ones are: the limit starves
  // the worst cells, and not the last ones of the image.
  std::sort(lacking.begin(), lacking.end(), [](const Lacking& a, const Lacking& b) {
    return std::tuple(-a.best(), a.cell) < std::tuple(-b.best(), b.cell);
  });
  std::vector<cv::Point2f> fresh;
  for (bool progress = true; progress && total < options_.num_pts;) {
    progress = false;
    for (Lacking& one : lacking) {
      int& count = counts[static_cast<std::size_t>(one.cell)];
      if (total >= options_.num_pts) break;
      if (count >= per_cell_) continue;
      while (one.next < one.found.size() && !spacing.add_if_free(one.found[one.next].uv)) {
        ++one.next;
      }
      if (one.next == one.found.size()) continue;
      fresh.push_back(one.found[one.next++].uv);
      ++count;
      ++total;
      progress = true;
    }
  }
  refine(frame, fresh);
  points.insert(points.end(), fresh.begin(), fresh.end());
}

}  // namespace viwo::klt
