// A run's result with fewer points in its series.
#pragma once

#include <cstddef>

#include "viwo/run/run_result.hpp"

namespace viwo {

/// Points that are kept of each series of a run in an experiment.
inline constexpr std::size_t kRecordPoints = 150;

/// Thins all series of a run to about `max_points`, first and last kept; counts of factors are
/// summed over what is left out. Matrices of the run's odometry are dropped.
void thin(RunResult& run, std::size_t max_points = kRecordPoints);

/// For a run whose series are not drawn by themselves: no more than their ends but for the NEES.
void keep_ends(RunResult& run);

/// The series of the monitor alone.
void thin(MonitorTrack& monitor, std::size_t max_points);

/// Takes the newest epoch out of the series; the totals of the updates are then those before it.
/// There must be one, and no reference in the frame of the estimate.
void drop_last_point(RunResult& run);

}  // namespace viwo
