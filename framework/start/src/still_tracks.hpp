// Whether the points of images have stayed where they were while a start looked at them.
#pragma once

#include <cstdint>
#include <span>

#include "viwo/api/measurement.hpp"

namespace viwo {

enum class Stillness : std::uint8_t {
  kUnknown,   ///< no images, or too few points in common
  kTooEarly,  ///< there are images, but they do not reach far enough back
  kStill,
  kMoved
};

/// Of the images between two instants of the IMU's clock, the later one with the last. A pair of
/// images has moved when the points that both have are further apart than the points of
/// neighbouring images are, by more than two pixels in the median: those err as much, and
/// vibration moves them as much. `t_CtoI_s`: by camera.
Stillness stillness_of(std::span<const FeatureSample> tracks, std::span<const double> t_CtoI_s,
                       std::int64_t begin_ns, std::int64_t end_ns);

}  // namespace viwo
