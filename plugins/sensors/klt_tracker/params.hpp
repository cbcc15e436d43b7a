// Parameters of the plugin, named as in OpenVINS and VINS-Fusion where these have them.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>

#include "image_groups.hpp"
#include "tracker_options.hpp"
#include "viwo/api/params.hpp"

namespace viwo::klt {

struct Params : TrackerOptions {
  std::filesystem::path cameras;
  int n_cameras = 0;
  bool stereo = true;
  double max_camera_dt_s = 0.003;
  double max_gap_s = 0.5;
  std::filesystem::path mask0, mask1, mask2, mask3;

  const std::filesystem::path& mask(std::size_t camera) const {
    return *std::array{&mask0, &mask1, &mask2, &mask3}[camera];
  }

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(cameras),
      {.required = true, .help = "Kalibr camera chain of the cameras that the images are from"});
    b(VIWO_PARAM(n_cameras),
      {.min = 0.,
       .max = kMaxCameras,
       .help = "use images of the first n cameras; 0: all of the chain, at most four"});
    b(VIWO_PARAM(stereo),
      {.help =
           "cameras 0 and 1 are a pair, and so are 2 and 3, if they see the same: points of the "
           "first are looked for in the second, under the same id; otherwise each camera has "
           "its own points"});
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
    b(VIWO_PARAM(mask2), {.help = "the same for camera 2"});
    b(VIWO_PARAM(mask3), {.help = "the same for camera 3"});
  }
};

}  // namespace viwo::klt
