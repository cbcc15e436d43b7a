// A turn of O on the base that rows do not tell, for they are blind to where their wheels point.
// Equations: model.md beside this file.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "viwo/wheel/held_gauge.hpp"

namespace viwo::wheel_odometry {

/// How the intrinsics change with the yaw of another O (WO-22). It goes with the estimate while the
/// wheels become known, and stays after that: a direction that nothing tells, and that moves with
/// what the estimate does by chance, would be told by how it moved.
class HiddenTurn {
 public:
  /// An interval in which O turned for sure.
  void add_turn() { ++turns_; }

  /// Nothing where the model has no other O.
  const std::optional<Intrinsics>& at(const WheelModel& model, const Intrinsics& x_WI) {
    if (!by_yaw_ || turns_ < kLearning) by_yaw_ = intrinsics_by_frame(model, x_WI, 0);
    return by_yaw_;
  }

 private:
  /// Turns in which wheels become known: ten seconds of a sweep. With 30, what they did not know
  /// yet was left in places that do not turn (ten minutes, NEES 3.9).
  static constexpr int kLearning = 100;

  std::optional<Intrinsics> by_yaw_;
  int turns_ = 0;
};

}  // namespace viwo::wheel_odometry
