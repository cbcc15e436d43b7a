// How far apart samples of a robot's sensors are; stamps that say otherwise are of another unit.
#pragma once

namespace viwo {

inline constexpr double kShortestPeriod_s = 25e-6;     ///< the fastest gyros give 32 kHz
inline constexpr double kLongestEncoderPeriod_s = 2.;  ///< wheels that are read at all

}  // namespace viwo
