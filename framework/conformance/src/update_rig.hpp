// A small robot with a filter, for the checks of updates.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "viwo/api/measurement.hpp"
#include "viwo/api/update.hpp"

namespace viwo::conformance {

/// What a robot with IMU, a camera, four driven wheels and a pose reference measures.
struct Drive {
  StateSample start;
  std::vector<Measurement> measurements;  ///< in time order
};

/// A motion of sim::PlanarMotion.
Drive simulate_drive(const char* motion, double duration_s);

/// Runs `update`, of the kind it says it is, in a filter over the drive. Throws what it throws at
/// its start; while it runs the estimator goes on without it. Returns how many epochs there were.
std::int64_t run_update(const std::shared_ptr<Update>& update, const Drive& drive);

}  // namespace viwo::conformance
