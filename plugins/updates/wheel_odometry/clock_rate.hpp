// The column of the clock: how the pose of an interval changes when both of its instants move on,
// of two instruments, the wheels and the IMU. Equations: model.md beside this file.
#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>

#include "interval.hpp"
#include "viwo/api/filter_view.hpp"

namespace viwo::wheel_odometry {

/// What the wheels say of an interval.
struct WheelRate {
  std::optional<Eigen::Vector3d> g;  ///< rad/s, m/s: Instrument::rate()
  double duration_s = 0.;
  Eigen::Vector3d variance_of_pose = Eigen::Vector3d::Zero();  ///< rad^2, m^2
};

/// Of both, weighted by their noise (WO-13). `at` has the motion of the clones, and `imu` are the
/// samples of the epoch.
Rate clock_rate(const WheelRate& wheels, const Point& at, const FilterView& filter,
                std::span<const ImuSample> imu);

}  // namespace viwo::wheel_odometry
