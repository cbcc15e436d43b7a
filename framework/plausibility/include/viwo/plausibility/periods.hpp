// How far apart samples of a robot's sensors are; stamps that say otherwise are of another unit.
#pragma once

#include <cstdint>

namespace viwo {

inline constexpr double kShortestPeriod_s = 25e-6;     ///< the fastest gyros give 32 kHz
inline constexpr double kLongestEncoderPeriod_s = 2.;  ///< wheels that are read at all

/// Of so many samples in the time of so many epochs: many more than samples, and more than memory
/// is for.
inline bool are_of_two_clocks(std::int64_t samples, std::int64_t epochs) {
  constexpr std::int64_t kMostEpochs = 100'000, kMostPerSample = 100;
  return epochs > kMostEpochs && epochs / samples > kMostPerSample;
}

}  // namespace viwo
