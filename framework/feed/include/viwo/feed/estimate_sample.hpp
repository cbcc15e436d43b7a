// What sensors are told of the filter after an epoch.
#pragma once

#include <string>
#include <vector>

#include "viwo/api/sensor.hpp"
#include "viwo/estimator/estimator.hpp"

namespace viwo {

/// All but the latency.
EstimateSample estimate_sample(const Filter& filter, int piece,
                               const std::vector<std::string>& warnings);

}  // namespace viwo
