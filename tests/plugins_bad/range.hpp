// A kind of samples of somebody else's, as the build says: its name, its version, its members.
#pragma once

#include <cstdint>

#include "viwo/api/sample.hpp"

#ifndef BAD_KIND
#define BAD_KIND "range"
#endif
#ifndef BAD_VERSION
#define BAD_VERSION 1
#endif

namespace bad {

struct RangeSample {
  std::int64_t t_ns = 0;
#ifdef BAD_ORDER
  double range_m = 0.;
  int beacon = 0;
#else
  int beacon = 0;
  double range_m = 0.;
#endif
};

}  // namespace bad

VIWO_SAMPLE(bad::RangeSample, BAD_KIND, BAD_VERSION, &bad::RangeSample::t_ns,
            &bad::RangeSample::beacon, &bad::RangeSample::range_m);
