// Where the zeros of steering encoders are, anywhere on the circle, and which drives turn
// backwards: what a fit, which only looks around where it starts, cannot find.
#pragma once

#include <string>
#include <vector>

#include "viwo/calibration/calibrate.hpp"

namespace viwo::calibration {

/// For each steering channel the intrinsic that is its zero: the model sees no difference between
/// a reading that grows and this one that shrinks (or grows with it). -1 where there is none.
std::vector<int> steering_zeros(const WheelModel& model);

/// Searches the recordings named by index for what `setup.options` asks (CAL-12). Throws InputError
/// when the model has no intrinsic for the zero of a steering channel.
JointSearch search_joints(const CalibrationSetup& setup,
                          const std::vector<std::size_t>& recordings);

/// Multiplies what the drives of all recordings read by 1 or -1.
void reverse_drives(CalibrationSetup& setup, const std::vector<int>& signs);

}  // namespace viwo::calibration
