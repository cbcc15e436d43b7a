// Parameters of the update visual_features.
#pragma once

#include "viwo/api/params.hpp"

namespace viwo::visual {

struct Params {
  double sigma_px = 1.;
  bool find_noise = true;
  bool linearise_twice = true;
  int max_features = 100;
  double gate_probability = 0.001;
  int min_observations = 2;
  int max_tracks = 2000;
  int max_landmarks = 0;
  double min_distance_m = 0.1;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(sigma_px),
      {.unit = "px",
       .above = 0.,
       .help = "noise of a feature, per coordinate of the image as it is (distorted)"});
    b(VIWO_PARAM(find_noise),
      {.help = "sigma_px is scaled up where the residuals are larger, and what they tell is "
               "reported; false: as configured"});
    b(VIWO_PARAM(linearise_twice),
      {.help = "an epoch whose rows leave out more than sigma_px by being linear is linearised "
               "once more where it puts the window; false: at the estimate alone"});
    b(VIWO_PARAM(max_features),
      {.min = 1.,
       .max = 100000.,
       .help = "most tracks with a point that are taken in one epoch, of three times as many that "
               "are tried; the longest come first"});
    b(VIWO_PARAM(gate_probability),
      {.min = 0.,
       .max = 0.999,
       .help = "a track whose chi-square is less likely than this is dropped; 0: no gate"});
    b(VIWO_PARAM(min_observations),
      {.min = 2.,
       .help = "fewest observations, of all cameras together, that a track is used with"});
    b(VIWO_PARAM(max_tracks),
      {.min = 1.,
       .max = 1000000.,
       .help = "room for tracks at a time; new points beyond it are dropped"});
    b(VIWO_PARAM(max_landmarks),
      {.min = 0.,
       .max = 1000.,
       .help = "most landmarks that are kept in the state, from tracks that outlive the "
               "window; 0: none"});
    b(VIWO_PARAM(min_distance_m),
      {.unit = "m",
       .min = 0.,
       .help = "no point is nearer to a camera: a track that has one there is not used"});
  }
};

}  // namespace viwo::visual
