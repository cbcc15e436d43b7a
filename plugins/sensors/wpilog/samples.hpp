// From the entries of a log to the samples of a sensor.
#pragma once

#include "params.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/log/recording.hpp"

namespace viwo::wpilog {

/// All that the parameters name, in time order. ParamError for an entry that is not there or does
/// not fit, InputError for what is wrong with the log.
log::Recording<Measurement> read_samples(const Params& params);

}  // namespace viwo::wpilog
