// What the parts of the tracker are told; the parameters of the plugin (params.hpp) fill it.
#pragma once

#include <algorithm>
#include <cstdint>

namespace viwo::klt {

enum class Histogram : std::uint8_t { kNone, kEqualize, kClahe };

struct TrackerOptions {
  int num_pts = 200;  ///< points of an image
  int fast_threshold = 20;
  int grid_x = 5;  ///< cells of the image, across
  int grid_y = 5;  ///< and down
  int min_px_dist = 10;
  int win_size = 15;   ///< side of the window that is compared, px
  int pyr_levels = 3;  ///< levels of the pyramid above the image itself
  Histogram histogram = Histogram::kNone;
  bool subpixel = true;
  bool refine = true;  ///< fit points to what they were when they were found
  bool ransac = true;
  double ransac_threshold_px = 1.;
  double stereo_threshold_px = 2.;
  int min_contrast = 12;  ///< grey levels; an image with less has nothing to track
};

/// Points keep this distance from the border, so that their windows are inside of the image.
inline int border_px(const TrackerOptions& options) {
  constexpr int kPatch = 9;  // the window of Patch, and its derivatives
  return std::max(options.win_size / 2 + 1, kPatch);
}

}  // namespace viwo::klt
