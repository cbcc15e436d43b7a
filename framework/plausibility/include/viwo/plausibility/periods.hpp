// How far apart samples of a robot's sensors are; stamps that say otherwise are of another unit.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "viwo/api/measurement.hpp"

namespace viwo {

inline constexpr double kShortestPeriod_s = 25e-6;     ///< the fastest gyros give 32 kHz
inline constexpr double kLongestEncoderPeriod_s = 2.;  ///< wheels that are read at all

/// Of so many samples in the time of so many epochs: many more than samples, and more than time and
/// memory are for.
inline bool are_of_two_clocks(std::int64_t samples, std::int64_t epochs) {
  constexpr std::int64_t kManyEpochs = 100'000, kMostPerSample = 20;
  return epochs > kManyEpochs && epochs / samples > kMostPerSample;
}

/// What time is cut into: results are kept of each.
inline constexpr std::int64_t kMostEpochs = 2'000'000;

/// Why samples of wheels, in order and at least one, cannot be those of a robot, or are of more
/// time than `kMostEpochs`; "are 20 in 1e+06 s: ...", empty if nothing is wrong.
std::string fault_of_times(std::span<const EncoderSample> wheels, double epoch_s);

}  // namespace viwo
