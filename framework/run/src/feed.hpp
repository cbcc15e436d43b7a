// Hands what the sensors of a run give to the estimator, and to the check of their plausibility.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "viwo/plausibility/plausibility.hpp"
#include "viwo/run/run.hpp"

namespace viwo {

class Feed {
 public:
  virtual ~Feed() = default;
  /// Gives the estimator the next measurement; false when there is none left. Throws InputError
  /// when a sensor is broken.
  virtual bool next(Estimator& estimator) = 0;
  /// Whether what has been given is not to be waited for any more.
  virtual bool is_over() { return false; }
  /// An epoch of piece 0, 1, ... of live sensors is done, and what is wrong by now.
  virtual void on_epoch(const Estimator& /*estimator*/, int /*piece*/,
                        const std::vector<std::string>& /*warnings*/) {}
  /// Ends what still runs, and records what the sensors took, dropped and gave as reference.
  virtual void finish(RunResult& result) = 0;
};

/// All measurements in the order of their stamps: the same in every run.
std::unique_ptr<Feed> feed_recorded(const RunSetup& setup, const RunData& data,
                                    Plausibility& plausibility);

/// Measurements of live sensors that are played, in the order in which the same recorded ones would
/// be given: the run waits for them, and they for the run. hooks.interrupted as below.
std::unique_ptr<Feed> feed_in_step(const RunSetup& setup, const RunData& data,
                                   const RunHooks& hooks, Plausibility& plausibility);

/// Measurements as they come. hooks.interrupted is asked now and then whether that is to end.
std::unique_ptr<Feed> feed_live(const RunSetup& setup, const RunData& data, const RunHooks& hooks,
                                Plausibility& plausibility);

}  // namespace viwo
