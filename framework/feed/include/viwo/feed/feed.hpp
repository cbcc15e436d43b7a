// Hands what the sensors of a run give to the estimator, and to the check of their plausibility.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "viwo/feed/run_data.hpp"
#include "viwo/feed/stage_time.hpp"
#include "viwo/plausibility/plausibility.hpp"

namespace viwo {

/// Who is asked, and told, while measurements are given; either may be empty.
struct FeedHooks {
  std::function<bool()> interrupted;  ///< whether the run is to end now, with what it has
  /// A live sensor has given an image, which is still to be worked on. In another thread.
  std::function<void(const ImageSample&)> on_live_image;
};

/// What the sensors gave as reference, and what they took and dropped.
struct FeedReport {
  std::string cause;  ///< why there cannot be a result; "" where there can
  Trajectory reference;
  std::vector<std::pair<std::string, StageTime>> stages;
  std::vector<std::pair<std::string, RejectionCount>> rejections;
  std::vector<std::string> warnings;
};

/// FeedReport::cause of live sensors that gave nothing to estimate from.
inline constexpr const char* kNothingCame = "nothing has come: no IMU sample arrived";

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
  /// Ends what still runs.
  virtual FeedReport finish() = 0;
};

/// All measurements in the order of their stamps: the same in every run.
std::unique_ptr<Feed> feed_recorded(const RunSetup& setup, const RunData& data,
                                    Plausibility& plausibility);

/// Measurements of live sensors that are played, in the order in which the same recorded ones would
/// be given: the run waits for them, and they for the run. hooks.interrupted as below.
std::unique_ptr<Feed> feed_in_step(const RunSetup& setup, const RunData& data,
                                   const FeedHooks& hooks, Plausibility& plausibility);

/// Measurements as they come. hooks.interrupted is asked now and then whether that is to end.
std::unique_ptr<Feed> feed_live(const RunSetup& setup, const RunData& data, const FeedHooks& hooks,
                                Plausibility& plausibility);

}  // namespace viwo
