// What both feeds of live sensors do with a sample beside giving it to the estimator.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <set>
#include <string>

#include "sample_gate.hpp"
#include "viwo/feed/bounded_series.hpp"
#include "viwo/feed/feed.hpp"
#include "viwo/math/trajectory.hpp"

namespace viwo {

/// Looks at the first encoder sample of each sensor, keeps the reference, and notes whether an IMU
/// sends.
class LiveSamples {
 public:
  /// Of the reference about `most_reference` poses are kept, evenly, however long the run is.
  LiveSamples(const RunSetup& setup, std::size_t most_reference)
      : setup_(setup), reference_(most_reference) {}

  /// InputError for encoder samples without the channels of their wheels.
  void note(const std::string& sensor, SampleView sample);
  /// Adds the reference, what was refused of it, and why there cannot be a result.
  void finish(FeedReport& report) const;

 private:
  void add_to_reference(const StampedPose& pose);
  Trajectory reference() const;

  const RunSetup& setup_;
  std::set<std::string> checked_;  ///< sensors whose encoder channels have been looked at
  bool has_imu_ = false;
  std::optional<StampedPose> newest_;  ///< of the reference
  /// Each with the one before: between two there is a pose to compare with, however few are kept.
  BoundedSeries<std::array<StampedPose, 2>> reference_;
  SampleGate gate_;  ///< of the reference
};

}  // namespace viwo
