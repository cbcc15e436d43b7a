#include "viwo/view/tracks.hpp"

#include <algorithm>
#include <utility>

namespace viwo::view {

std::span<const FeatureSample> images_of(const EpochData& data) {
  for (const SampleSpan& stream : data.streams) {
    if (stream.type != nullptr && *stream.type == sample_type<FeatureSample>()) {
      return {static_cast<const FeatureSample*>(stream.data), stream.size};
    }
  }
  return {};
}

void Tracks::add(std::span<const FeaturePoint> points) {
  std::vector<Track> now;
  now.reserve(points.size());
  for (const FeaturePoint& point : points) {
    const auto before =
        std::lower_bound(tracks_.begin(), tracks_.end(), point.id,
                         [](const Track& track, std::int64_t id) { return track.id < id; });
    Track track;
    track.id = point.id;
    if (before != tracks_.end() && before->id == point.id) {
      track.images = before->images;
      track.trail = std::move(before->trail);
    }
    ++track.images;
    if (track.trail.size() == kTrailImages) track.trail.erase(track.trail.begin());
    track.trail.push_back({point.u_px, point.v_px});
    now.push_back(std::move(track));
  }
  std::sort(now.begin(), now.end(), [](const Track& a, const Track& b) { return a.id < b.id; });
  tracks_ = std::move(now);
}

void RecentImages::add(std::span<const FeaturePoint> points) {
  if (points.size() > images_.front().capacity()) {
    for (auto& image : images_) image.reserve(2 * points.size());
  }
  images_[n_++ % images_.size()].assign(points.begin(), points.end());
}

std::span<const FeaturePoint> RecentImages::points() const {
  if (n_ == 0) return {};
  return images_[(n_ - 1) % images_.size()];
}

Tracks RecentImages::tracks() const {
  Tracks tracks;
  for (std::size_t i = n_ - std::min(n_, images_.size()); i < n_; ++i) {
    tracks.add(images_[i % images_.size()]);
  }
  return tracks;
}

}  // namespace viwo::view
