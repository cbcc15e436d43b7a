// Parameters of the update visual_features.
#pragma once

#include <array>

#include "viwo/api/params.hpp"

namespace viwo::visual {

inline constexpr std::array kParams{
    ParamSpec{.name = "sigma_px",
              .type = ParamType::kNumber,
              .unit = "px",
              .fallback = "1",
              .min = 0.,
              .min_exclusive = true,
              .help = "noise of a feature, per coordinate of the image as it is (distorted)"},
    ParamSpec{.name = "find_noise",
              .type = ParamType::kBool,
              .fallback = "true",
              .help = "sigma_px is scaled to what the residuals tell, and reported; false: as "
                      "configured"},
    ParamSpec{.name = "max_features",
              .type = ParamType::kInt,
              .fallback = "100",
              .min = 1.,
              .max = 100000.,
              .help = "most tracks that are tried in one epoch; the longest come first"},
    ParamSpec{.name = "gate_probability",
              .type = ParamType::kNumber,
              .fallback = "0.001",
              .min = 0.,
              .max = 0.999,
              .help = "a track whose chi-square is less likely than this is dropped; 0: no gate"},
    ParamSpec{.name = "min_observations",
              .type = ParamType::kInt,
              .fallback = "2",
              .min = 2.,
              .help = "fewest observations, of all cameras together, that a track is used with"},
    ParamSpec{.name = "max_tracks",
              .type = ParamType::kInt,
              .fallback = "2000",
              .min = 1.,
              .max = 1000000.,
              .help = "room for tracks at a time; new points beyond it are dropped"},
    ParamSpec{.name = "max_landmarks",
              .type = ParamType::kInt,
              .fallback = "0",
              .min = 0.,
              .max = 1000.,
              .help = "most landmarks that are kept in the state, from tracks that outlive the "
                      "window; 0: none"},
    ParamSpec{.name = "min_distance_m",
              .type = ParamType::kNumber,
              .unit = "m",
              .fallback = "0.1",
              .min = 0.,
              .help = "a track whose point is nearer to one of its cameras is not used"},
    ParamSpec{.name = "max_distance_m",
              .type = ParamType::kNumber,
              .unit = "m",
              .fallback = "1000",
              .min = 0.,
              .min_exclusive = true,
              .help = "a track whose point is farther from all of its cameras is not used"},
    ParamSpec{.name = "max_condition",
              .type = ParamType::kNumber,
              .fallback = "1e6",
              .min = 1.,
              .max = 1e8,
              .help = "largest condition number of the intersection of a track's rays; 1e4 is a "
                      "parallax of about one degree, 1e6 of a tenth"}};

}  // namespace viwo::visual
