// Parameters that the sensors which play bags have in common: all but where the bag is.
#pragma once

#include "topic_options.hpp"
#include "viwo/api/params.hpp"
#include "viwo/log/sensor_params.hpp"

namespace viwo::bag {

struct BagOptions : TopicOptions,
                    log::StrideParams,
                    log::ClockParams,
                    log::PieceParams,
                    log::MaxRejectedParams {
  int gnss_stride = 1;

  void bind(ParamBinder& b) {
    TopicOptions::bind(b);
    log::StrideParams::bind(b);
    log::ClockParams::bind(b);
    log::PieceParams::bind(b);
    b(VIWO_PARAM(gnss_stride),
      {.min = 1.,
       .max = 1e6,
       .help = "every n-th fix is given; the others are left for a comparison"});
    log::MaxRejectedParams::bind(b);
  }

  LogLimits limits() const { return {max_gap_s, max_rejected_fraction}; }
  /// Itself; ParamError for parameters that contradict each other.
  const BagOptions& checked() const {
    check("path", "read");
    check_stride(drive_is_angle(), "position");
    return *this;
  }
};

}  // namespace viwo::bag
