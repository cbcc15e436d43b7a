// What the parts of the tracker are told.
#pragma once

#include <algorithm>
#include <cstdint>

#include "viwo/api/params.hpp"

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
  Histogram histogram_method = Histogram::kNone;
  bool subpixel = true;
  bool refine = true;  ///< fit points to what they were when they were found
  bool ransac = true;
  double ransac_threshold_px = 1.;
  double stereo_threshold_px = 2.;
  int min_contrast = 12;  ///< grey levels; an image with less has nothing to track

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(num_pts), {.min = 1., .max = 5000., .help = "points of an image, at most"});
    b(VIWO_PARAM(fast_threshold),
      {.min = 1.,
       .max = 254.,
       .help = "grey levels that a corner differs from its surroundings by"});
    b(VIWO_PARAM(grid_x), {.min = 1.,
                           .max = 100.,
                           .help = "columns of cells that each get the same share of the points"});
    b(VIWO_PARAM(grid_y), {.min = 1., .max = 100., .help = "rows of these cells"});
    b(VIWO_PARAM(min_px_dist),
      {.min = 1.,
       .max = 500.,
       .help = "distance of a new point from all others; of two tracks that come together "
               "to half of it the younger one ends"});
    b(VIWO_PARAM(win_size), {.min = 5., .max = 63., .help = "side of the window that is followed"});
    b(VIWO_PARAM(pyr_levels),
      {.min = 0.,
       .max = 8.,
       .help = "levels of the pyramid above the image; each doubles the motion that can be "
               "followed"});
    b(VIWO_PARAM(histogram_method),
      {{"none", Histogram::kNone},
       {"histogram", Histogram::kEqualize},
       {"clahe", Histogram::kClahe}},
      {.help = "equalisation of the grey levels before anything else"});
    b(VIWO_PARAM(subpixel), {.help = "move new points to the corner, to a fraction of a pixel"});
    b(VIWO_PARAM(refine),
      {.help = "fit every point to what it looked like when it was found, with an affine "
               "deformation, so that it does not drift; it ends when it is not like that"});
    b(VIWO_PARAM(ransac), {.help = "drop points that do not move as one rigid scene"});
    b(VIWO_PARAM(ransac_threshold_px),
      {.unit = "px",
       .above = 0.,
       .help = "distance from the epipolar plane, as an angle times the focal length"});
    b(VIWO_PARAM(stereo_threshold_px),
      {.unit = "px", .above = 0., .help = "the same between the cameras of a pair"});
    b(VIWO_PARAM(min_contrast),
      {.min = 1.,
       .max = 255.,
       .help = "grey levels between the darkest and the brightest 2 %; with less an image "
               "is dark, and tracks end"});
  }
};

/// Points keep this distance from the border, so that their windows are inside of the image.
inline int border_px(const TrackerOptions& options) {
  constexpr int kPatch = 9;  // the window of Patch, and its derivatives
  return std::max(options.win_size / 2 + 1, kPatch);
}

}  // namespace viwo::klt
