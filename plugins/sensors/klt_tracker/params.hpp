// Parameters of the plugin, named as in OpenVINS and VINS-Fusion where these have them.
#pragma once

#include <filesystem>

#include "tracker_options.hpp"
#include "viwo/api/params.hpp"

namespace viwo::klt {

struct Params : TrackerOptions {
  std::filesystem::path cameras;
  int n_cameras = 0;
  bool stereo = true;
  double max_camera_dt_s = 0.003;
  double max_gap_s = 0.5;
  std::filesystem::path mask0;
  std::filesystem::path mask1;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(cameras),
      {.required = true, .help = "Kalibr camera chain of the cameras that the images are from"});
    b(VIWO_PARAM(n_cameras),
      {.min = 0.,
       .max = 2.,
       .help = "use images of the first n cameras; 0: all of the chain, at most two"});
    b(VIWO_PARAM(stereo),
      {.help = "with two cameras: points of camera 0 are looked for in camera 1, under the "
               "same id; otherwise each camera has its own points"});
    b(VIWO_PARAM(max_camera_dt_s),
      {.unit = "s",
       .min = 0.,
       .max = 1.,
       .help = "images of two cameras whose stamps differ by no more are one pair"});
    b(VIWO_PARAM(max_gap_s),
      {.unit = "s", .above = 0., .help = "tracks end when there is no image for longer"});
    TrackerOptions::bind(b);
    b(VIWO_PARAM(mask0),
      {.help = "image of the size of camera 0's: no points where it is white; '': none"});
    b(VIWO_PARAM(mask1), {.help = "the same for camera 1"});
  }
};

}  // namespace viwo::klt
