// The section `updates` of a run configuration.
#pragma once

#include <cstdint>

#include "viwo/setup/filter_setup.hpp"

namespace viwo {

/// Makes the updates of a run and tries whether an estimator can work with them; what is wrong is
/// appended to `errors`. `setup` has the cameras and wheels.
void read_updates(const config::Node& run, const ReadContext& context, FilterSetup& setup,
                  config::Node& resolved, config::Errors& errors);

}  // namespace viwo
