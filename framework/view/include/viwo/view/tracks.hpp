// The tracked points of one camera with the way that each has come in its image.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "viwo/api/measurement.hpp"

namespace viwo::view {

/// Images over which the trail of a point goes back.
inline constexpr std::size_t kTrailImages = 10;

struct TrailPoint {
  double u_px = 0.;
  double v_px = 0.;
};

/// One point, seen in the newest image.
struct Track {
  std::int64_t id = 0;
  int images = 0;                 ///< in a row in which it was seen
  std::vector<TrailPoint> trail;  ///< newest last, at most kTrailImages
};

class Tracks {
 public:
  /// The points of the next image. A point that is not among them is forgotten.
  void add(std::span<const FeaturePoint> points);
  /// Of the newest image, by increasing id.
  const std::vector<Track>& tracks() const { return tracks_; }

 private:
  std::vector<Track> tracks_;
};

}  // namespace viwo::view
