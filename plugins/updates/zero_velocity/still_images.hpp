// Whether the points of images have stayed where they were, compared over a window that is long
// enough for slow motion to show.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "viwo/api/measurement.hpp"

namespace viwo {

/// Remembers an image of the first camera that has any, window_s to 2 window_s old.
class StillImages {
 public:
  enum Verdict { kStill, kMoved, kTooEarly, kUnknown };

  StillImages(double max_disparity_px, int min_points, double window_s)
      : max_disparity_px_(max_disparity_px),
        min_points_(static_cast<std::size_t>(min_points)),
        window_s_(window_s) {}

  void reserve() {
    for (Image* image : {&old_, &young_, &now_}) image->points.reserve(kMostPoints);
    distances_.reserve(kMostPoints);
  }

  /// What was remembered is of a base that moved.
  void forget() { old_.valid = young_.valid = false; }

  /// kUnknown: no image of that camera, or too few points in common; kTooEarly: none that is old
  /// enough.
  Verdict compare(std::span<const FeatureSample> features) {
    if (features.empty()) return kUnknown;
    auto of_it = features.begin();
    if (young_.valid) {
      // Cameras may take turns: an epoch is of one, the next one of another.
      of_it = std::find_if(features.begin(), features.end(), [this](const FeatureSample& sample) {
        return sample.camera == young_.camera;
      });
      const std::int64_t now_ns = features.front().t_ns;
      const bool has_ended = seconds_between(young_.t_ns, now_ns) > 2. * window_s_;
      if (of_it == features.end()) {
        if (!has_ended) return kUnknown;
        forget();
        of_it = features.begin();
      }
    }
    take(*of_it);
    if (now_.points.size() < min_points_) return kUnknown;
    if (!young_.valid) {
      std::swap(young_, now_);
      return kTooEarly;
    }
    Verdict verdict = kTooEarly;
    if (old_.valid) {
      verdict = judge(old_);
    } else if (seconds_between(young_.t_ns, now_.t_ns) >= window_s_) {
      verdict = judge(young_);
    }
    // The younger one grows old; what is now is remembered in its place.
    if (verdict == kMoved || verdict == kUnknown) {
      forget();
      std::swap(young_, now_);
    } else if (seconds_between(young_.t_ns, now_.t_ns) >= window_s_) {
      std::swap(old_, young_);
      std::swap(young_, now_);
    }
    return verdict;
  }

 private:
  static constexpr std::size_t kMostPoints = 4096;

  struct Image {
    bool valid = false;
    int camera = 0;
    std::int64_t t_ns = 0;
    std::vector<FeaturePoint> points;  // by id
  };

  void take(const FeatureSample& sample) {
    now_.valid = true;
    now_.camera = sample.camera;
    now_.t_ns = sample.t_ns;
    now_.points.assign(sample.points.begin(),
                       sample.points.begin() + static_cast<std::ptrdiff_t>(
                                                   std::min(sample.points.size(), kMostPoints)));
    std::sort(now_.points.begin(), now_.points.end(),
              [](const FeaturePoint& a, const FeaturePoint& b) { return a.id < b.id; });
  }

  /// Median distance of the points in common.
  Verdict judge(const Image& then) {
    distances_.clear();
    auto a = then.points.begin();
    for (const FeaturePoint& point : now_.points) {
      while (a != then.points.end() && a->id < point.id) ++a;
      if (a == then.points.end()) break;
      if (a->id != point.id) continue;
      const double distance = std::hypot(point.u_px - a->u_px, point.v_px - a->v_px);
      if (std::isfinite(distance)) distances_.push_back(distance);
    }
    if (distances_.size() < min_points_) return kUnknown;
    const auto middle = distances_.begin() + static_cast<std::ptrdiff_t>(distances_.size() / 2);
    std::nth_element(distances_.begin(), middle, distances_.end());
    return *middle <= max_disparity_px_ ? kStill : kMoved;
  }

  double max_disparity_px_;
  std::size_t min_points_;
  double window_s_;
  Image old_, young_, now_;
  std::vector<double> distances_;
};

}  // namespace viwo
