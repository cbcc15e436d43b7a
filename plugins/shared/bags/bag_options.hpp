// Parameters that the sensors which play bags have in common.
#pragma once

#include <array>

#include "topic_options.hpp"
#include "viwo/api/params.hpp"
#include "viwo/log/sensor_params.hpp"
#include "viwo/log/stamp_filter.hpp"

namespace viwo::bag {

inline constexpr std::array kPlayParams{
    log::kStrideParam,
    log::kClockParam,
    ParamSpec{.name = "start_s",
              .type = ParamType::kNumber,
              .unit = "s",
              .fallback = "0",
              .min = 0.,
              .max = 1e9,
              .help = "leaves out what was recorded before this time after the first message"},
    ParamSpec{.name = "duration_s",
              .type = ParamType::kNumber,
              .unit = "s",
              .fallback = "0",
              .min = 0.,
              .max = 1e9,
              .help = "how long a piece is read from there; 0: up to the end"},
    ParamSpec{.name = "gnss_stride",
              .type = ParamType::kInt,
              .fallback = "1",
              .min = 1.,
              .max = 1e6,
              .help = "every n-th fix is given; the others are left for a comparison"},
    log::kMaxRejectedFractionParam};

/// All but where the bag is.
inline constexpr auto kBagParams = log::joined(kTopicParams, kPlayParams);

struct BagOptions : TopicOptions {
  log::LogLimits limits() const { return {max_gap_s, max_rejected_fraction}; }

  int stride = 1;  ///< of drive angles, see log::cells_from_angles()
  int gnss_stride = 1;
  double max_rejected_fraction = 0.1;
  bool by_reception = false;
  double start_s = 0.;
  double duration_s = 0.;
};

/// ParamError for parameters that contradict each other.
BagOptions options_from(const ParamSet& params);

}  // namespace viwo::bag
