// Whether encoder samples have the channels of the wheels that they are for.
#pragma once

#include <string>

#include "viwo/feed/run_data.hpp"

namespace viwo {

/// A sample of `sensor` against the kinematic model and the wheel sets that take it; InputError at
/// the position of the model or the sensors.
void require_channels(const RunSetup& setup, const std::string& sensor,
                      const EncoderSample& sample);

}  // namespace viwo
