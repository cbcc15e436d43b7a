// Starting a filter anew that has diverged: what of the time before can still be believed.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "viwo/setup/filter_setup.hpp"

namespace viwo {

/// Remembers where the IMU was and what the calibration of cameras and wheels was while the filter
/// was well. A filter is off for a while before that shows: the place is that of kPlaceAgeS before,
/// the calibration that of kCalibrationAgeS before, counted from when it lost contact with what is
/// measured, or from its end.
class HealthyState {
 public:
  static constexpr double kPlaceAgeS = 10.;
  static constexpr double kCalibrationAgeS = 30.;

  /// A filter as it is declared.
  explicit HealthyState(const Filter& filter);

  /// After each epoch.
  void epoch(const Estimator& estimator);
  /// The filter that was watched has failed: what another one is to begin with. Blocks that are
  /// further than four prior sigmas from what was declared are not kept.
  Continuation after_failure();

 private:
  struct State {
    std::int64_t t_ns = 0;
    Continuation::Place place;
    std::vector<std::vector<double>> blocks;  ///< by BlockId::index
  };
  State state_of(const Filter& filter) const;
  bool is_kept(std::size_t block, const std::vector<double>& value) const;

  std::vector<BlockSpec> declared_;
  std::deque<State> states_;  ///< one a second; oldest first
  std::optional<State> first_;
  std::int64_t newest_ns_ = 0;
  std::int64_t loosened_ = 0;
  std::optional<std::int64_t> lost_ns_, last_lost_ns_;  ///< first and last time it was loosened
  Continuation last_;
};

/// The setup of an estimator of the same updates that begins with `continuation`; nothing where
/// updates cannot be made another time.
std::optional<FilterSetup> again(const FilterSetup& setup, const Continuation& continuation);

}  // namespace viwo
