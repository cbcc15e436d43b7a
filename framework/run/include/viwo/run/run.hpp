// One run: sensors in, wheel odometry or the filter through it, trajectory and its accuracy out.
#pragma once

#include <functional>
#include <string>

#include "viwo/feed/feed.hpp"
#include "viwo/run/run_result.hpp"

namespace viwo {

/// Integrates the wheels from the first to the last common instant, starting at the reference pose
/// (or at the origin), and evaluates. A model that throws ends the run with the epoch and the
/// cause.
RunResult run_odometry(const RunSetup& setup, const RunData& data);

/// Called now and then with the part of the log's time that is done, 0 to 1.
using OnProgress = std::function<void(double)>;

/// Called when the estimator is about to begin; returns who is to watch it, or nullptr.
using OnStart = std::function<EstimatorObserver*(const Estimator&)>;

/// Who is to know what happens in a run; any of them may be empty.
struct RunHooks : FeedHooks {
  OnProgress progress;
  OnStart on_start;
  /// An epoch is done, and recorded in the result, which is not complete yet. The time this takes
  /// is none of the epoch's.
  std::function<void(const RunResult&)> on_epoch;
  /// The same with what the filter knows: time since the start [s].
  std::function<void(double, const Filter&)> on_estimate;
  /// Something is wrong with the run, said when it is first seen: time since the start [s], what.
  std::function<void(double, const std::string&)> on_warning;
};

/// Runs the filter over all measurements and evaluates. A filter that diverges, or a kinematic
/// model that throws, ends the run with the epoch and the cause.
RunResult run_filter(const RunSetup& setup, const RunData& data, const RunHooks& hooks = {});

/// What the configuration asks for.
inline RunResult run(const RunSetup& setup, const RunData& data, const RunHooks& hooks = {}) {
  return setup.filter ? run_filter(setup, data, hooks) : run_odometry(setup, data);
}

}  // namespace viwo
