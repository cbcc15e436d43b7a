// Where a point of one frame is in another, to a fraction of a pixel: Lucas-Kanade of a window that
// only moves, on the levels of the pyramids (model.md).
#pragma once

#include <opencv2/core.hpp>

#include "frame.hpp"
#include "tracker_options.hpp"

namespace viwo::klt {

/// The level on which following ends: refinement does the rest from 1 on.
inline int lowest_level(const TrackerOptions& options) {
  return options.refine && options.pyr_levels > 0 ? 1 : 0;
}

/// Follows the window around `from_uv` into another frame, from level `highest` (at most what there
/// is) down to lowest_level(). `uv` is the first guess and gets the result. False when there is no
/// texture, or when the window leaves the image or its surroundings.
bool follow_window(const Frame& from, const Frame& to, const TrackerOptions& options, int highest,
                   const cv::Point2f& from_uv, cv::Point2f& uv);

}  // namespace viwo::klt
