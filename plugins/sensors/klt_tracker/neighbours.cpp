#include "neighbours.hpp"

#include <limits>

namespace viwo::klt {

std::optional<Neighbours::Three> Neighbours::nearest(const cv::Point2f& place) const {
  Three tracks{};
  if (points_.size() < tracks.size()) return std::nullopt;
  std::array<float, 3> squares;
  squares.fill(std::numeric_limits<float>::infinity());
  for (const auto& [point, track] : points_) {
    const cv::Point2f apart = point - place;
    float square = apart.dot(apart);
    std::size_t one = track;
    for (std::size_t k = 0; k < tracks.size(); ++k) {  // sorted in
      if (!(square < squares[k])) continue;
      std::swap(square, squares[k]);
      std::swap(one, tracks[k]);
    }
  }
  return tracks;
}

}  // namespace viwo::klt
