// Parameters of the plugin, named as in OpenVINS and VINS-Fusion where these have them.
#pragma once

#include <array>

#include "tracker_options.hpp"
#include "viwo/api/params.hpp"

namespace viwo::klt {

// clang-format off
inline constexpr std::array kParams{
    ParamSpec{.name = "cameras", .type = ParamType::kPath,
              .help = "Kalibr camera chain of the cameras that the images are from"},
    ParamSpec{.name = "n_cameras", .type = ParamType::kInt, .fallback = "0", .min = 0., .max = 2.,
              .help = "use images of the first n cameras; 0: all of the chain, at most two"},
    ParamSpec{.name = "stereo", .type = ParamType::kBool, .fallback = "true",
              .help = "with two cameras: points of camera 0 are looked for in camera 1, under the "
                      "same id; otherwise each camera has its own points"},
    ParamSpec{.name = "max_camera_dt_s", .type = ParamType::kNumber, .unit = "s",
              .fallback = "0.003", .min = 0., .max = 1.,
              .help = "images of two cameras whose stamps differ by no more are one pair"},
    ParamSpec{.name = "max_gap_s", .type = ParamType::kNumber, .unit = "s", .fallback = "0.5",
              .min = 0., .min_exclusive = true,
              .help = "tracks end when there is no image for longer"},
    ParamSpec{.name = "num_pts", .type = ParamType::kInt, .fallback = "200", .min = 1.,
              .max = 5000., .help = "points of an image, at most"},
    ParamSpec{.name = "fast_threshold", .type = ParamType::kInt, .fallback = "20", .min = 1.,
              .max = 254., .help = "grey levels that a corner differs from its surroundings by"},
    ParamSpec{.name = "grid_x", .type = ParamType::kInt, .fallback = "5", .min = 1., .max = 100.,
              .help = "columns of cells that each get the same share of the points"},
    ParamSpec{.name = "grid_y", .type = ParamType::kInt, .fallback = "5", .min = 1., .max = 100.,
              .help = "rows of these cells"},
    ParamSpec{.name = "min_px_dist", .type = ParamType::kInt, .fallback = "10",
              .min = 1., .max = 500.,
              .help = "distance of a new point from all others; of two tracks that come together "
                      "to half of it the younger one ends"},
    ParamSpec{.name = "win_size", .type = ParamType::kInt, .fallback = "15",
              .min = 5., .max = 63., .help = "side of the window that is followed"},
    ParamSpec{.name = "pyr_levels", .type = ParamType::kInt, .fallback = "3", .min = 0., .max = 8.,
              .help = "levels of the pyramid above the image; each doubles the motion that can be "
                      "followed"},
    ParamSpec{.name = "histogram_method", .type = ParamType::kString, .fallback = "none",
              .choices = "none|histogram|clahe",
              .help = "equalisation of the grey levels before anything else"},
    ParamSpec{.name = "subpixel", .type = ParamType::kBool, .fallback = "true",
              .help = "move new points to the corner, to a fraction of a pixel"},
    ParamSpec{.name = "refine", .type = ParamType::kBool, .fallback = "true",
              .help = "fit every point to what it looked like when it was found, with an affine "
                      "deformation, so that it does not drift; it ends when it is not like that"},
    ParamSpec{.name = "ransac", .type = ParamType::kBool, .fallback = "true",
              .help = "drop points that do not move as one rigid scene"},
    ParamSpec{.name = "ransac_threshold_px", .type = ParamType::kNumber, .unit = "px",
              .fallback = "1", .min = 0., .min_exclusive = true,
              .help = "distance from the epipolar plane, as an angle times the focal length"},
    ParamSpec{.name = "stereo_threshold_px", .type = ParamType::kNumber, .unit = "px",
              .fallback = "2", .min = 0., .min_exclusive = true,
              .help = "the same between the cameras of a pair"},
    ParamSpec{.name = "min_contrast", .type = ParamType::kInt, .fallback = "12", .min = 1.,
              .max = 255.,
              .help = "grey levels between the darkest and the brightest 2 %; with less an image "
                      "is dark, and tracks end"},
    ParamSpec{.name = "mask0", .type = ParamType::kPath, .fallback = "''",
              .help = "image of the size of camera 0's: no points where it is white; '': none"},
    ParamSpec{.name = "mask1", .type = ParamType::kPath, .fallback = "''",
              .help = "the same for camera 1"},
};
// clang-format on

inline TrackerOptions read_options(const ParamSet& params) {
  TrackerOptions options;
  const auto integer = [&](const char* name) { return static_cast<int>(params.integer(name)); };
  options.num_pts = integer("num_pts");
  options.fast_threshold = integer("fast_threshold");
  options.grid_x = integer("grid_x");
  options.grid_y = integer("grid_y");
  options.min_px_dist = integer("min_px_dist");
  options.win_size = integer("win_size");
  options.pyr_levels = integer("pyr_levels");
  const std::string& histogram = params.text("histogram_method");
  options.histogram = histogram == "none"        ? Histogram::kNone
                      : histogram == "histogram" ? Histogram::kEqualize
                                                 : Histogram::kClahe;
  options.subpixel = params.flag("subpixel");
  options.refine = params.flag("refine");
  options.ransac = params.flag("ransac");
  options.ransac_threshold_px = params.number("ransac_threshold_px");
  options.stereo_threshold_px = params.number("stereo_threshold_px");
  options.min_contrast = integer("min_contrast");
  return options;
}

}  // namespace viwo::klt
