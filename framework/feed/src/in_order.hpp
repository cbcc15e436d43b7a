// What feeds have in common that give measurements in the order of their stamps.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "stream.hpp"
#include "viwo/feed/feed.hpp"
#include "viwo/feed/run_data.hpp"
#include "viwo/plausibility/plausibility.hpp"

namespace viwo {

/// Of what has one stamp: what nothing waits for, then the IMU, what epochs wait for, and what ends
/// them.
enum class Rank : std::uint8_t { kFirst, kImu, kAwaited, kEndsEpochs };

/// The routes of what a sensor gives of a kind that lead to the estimator, and their rank.
struct EstimatorRoutes {
  std::vector<Route> routes;
  Rank rank = Rank::kFirst;

  EstimatorRoutes(const RunSetup& setup, const std::string& sensor, const SampleType& type);
  void give(SampleView sample, Estimator& estimator) const;
};

/// The sensors that are read ahead while the filter runs.
class ReadAhead {
 public:
  ReadAhead(const RunSetup& setup, const std::vector<SensorStream>& streams,
            Plausibility& plausibility);

  /// Gives the earliest measurement of theirs, unless something else of the stamp `other_ns`, or
  /// earlier, comes before it. Waits for them to know. False when nothing was given.
  bool give_before(std::optional<std::int64_t> other_ns, Estimator& estimator);
  void finish(FeedReport& report);

 private:
  const RunSetup& setup_;
  Plausibility& plausibility_;
  std::vector<std::unique_ptr<Prefetch>> streams_;
};

}  // namespace viwo
