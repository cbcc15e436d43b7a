// What an estimator's monitors of excitation say, as part of a run's result.
#pragma once

#include "viwo/run/run.hpp"

namespace viwo {

/// Appends what the monitors of all wheel sets found out in the last epoch, at `t_s`, if they did.
void record_monitors(const Estimator& estimator, double t_s, MonitorTrack& track);

}  // namespace viwo
