// Where a recording says nothing of the motion.
#pragma once

#include <cstdint>
#include <vector>

#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {

/// By the clock of the wheels.
struct Hole {
  std::int64_t begin_ns, end_ns;
  double length_s() const { return seconds_between(begin_ns, end_ns); }
};

/// What is bridged is no measurement: of wheels that turned, and of a gyro, which is integrated or
/// was set to another value.
/// InputError for holes of the wheels in a drive that was measured by hand.
std::vector<Hole> holes_of(const CalibrationRecording& recording);

}  // namespace viwo::calibration
