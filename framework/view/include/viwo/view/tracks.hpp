// The tracked points of one camera with the way that each has come in its image.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "viwo/api/filter_view.hpp"
#include "viwo/api/measurement.hpp"

namespace viwo::view {

/// What cameras saw in an epoch, of the first stream that has it: others take the same.
std::span<const FeatureSample> images_of(const EpochData& data);

/// Images over which the trail of a point goes back.
inline constexpr std::size_t kTrailImages = 10;
/// Tracks of as many images, and longer ones, look the same.
inline constexpr int kLongTrack = 40;

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

/// The points of the last images of one camera. Keeping them is all that is done for each image; it
/// allocates nothing unless there are twice as many points as ever before. Tracks are made when
/// they are wanted.
class RecentImages {
 public:
  /// The points of the next image.
  void add(std::span<const FeaturePoint> points);
  /// Of the newest image.
  std::span<const FeaturePoint> points() const;
  /// Tracks of the newest image as Tracks makes them of all images, but for the count of images,
  /// which goes to kLongTrack.
  Tracks tracks() const;

 private:
  std::array<std::vector<FeaturePoint>, kLongTrack> images_;  ///< a ring
  std::size_t n_ = 0;                                         ///< images so far
};

}  // namespace viwo::view
