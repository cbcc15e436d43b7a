// The true calibration in the gauge that an estimate holds (docs/math/filter.md, F-12).
#pragma once

#include <Eigen/Core>

#include "viwo/api/rig.hpp"
#include "viwo/wheel/wheel_model.hpp"

namespace viwo {

/// Rewrites the true calibration of a wheel set (extrinsics and intrinsics) for the odometry frame
/// in which the entries that the gauge holds have the values of `held`. False, and nothing changed,
/// when the model's frame does not move (KinematicModel::move_frame) or no such frame exists.
bool move_to_held_gauge(const WheelModel& model, const Intrinsics& held, WheelsView& truth);

}  // namespace viwo
