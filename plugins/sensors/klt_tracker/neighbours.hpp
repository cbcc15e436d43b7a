// Points near a place of an image, which say what is likely there.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

namespace viwo::klt {

class Neighbours {
 public:
  /// Indices of tracks.
  using Three = std::array<std::size_t, 3>;

  void clear() { points_.clear(); }
  void add(const cv::Point2f& place, std::size_t track) { points_.emplace_back(place, track); }
  /// Tracks of the three points that are nearest; nothing where there are fewer.
  std::optional<Three> nearest(const cv::Point2f& place) const;

 private:
  std::vector<std::pair<cv::Point2f, std::size_t>> points_;
};

/// The middle one of what three tracks say: one of them may be on something else.
template <class Value>
auto median(const Neighbours::Three& tracks, const Value& value) {
  const auto a = value(tracks[0]), b = value(tracks[1]), c = value(tracks[2]);
  return std::max(std::min(a, b), std::min(std::max(a, b), c));
}

}  // namespace viwo::klt
