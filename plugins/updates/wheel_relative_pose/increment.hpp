// The increment of the odometry frame O over an interval and its derivatives, as the paper
// preintegrates them: one least-squares twist per encoder reading, the closed form over the time
// that it holds, Jacobian and covariance by recursion. Equations: model.md beside this file.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include <Eigen/Core>

#include "viwo/wheel/twist_solver.hpp"

namespace viwo::wheel_relative_pose {

struct IncrementOptions {
  TwistOptions twist = {};
  /// A reading holds from its stamp to the next one; else over its cell and up to the next cell.
  bool holds_from_stamp = true;
  /// Readings whose contact velocities contradict each other by more, |e_perp|, are left out. 0:
  /// none.
  double residual_gate_m_per_s = 0.;
};

/// g = [theta, x, y]: yaw (counter-clockwise positive) and position of O at the end, in O at the
/// start; rad, m, m.
struct Increment {
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  IntrinsicJacobian J_g_WI;                       ///< 3 x n: dg/dx_WI
  Eigen::Matrix3d P_g = Eigen::Matrix3d::Zero();  ///< P_m of the paper
  double longest_hold_s = 0.;                     ///< longest time that one reading had to do for
  std::int64_t gated = 0;                         ///< readings beyond the gate
  std::int64_t refused = 0;                       ///< readings without a twist

  void reset(int n_intrinsics);
};

/// Moves on by `dt_s` with the twist of one reading (RP-3 .. RP-5).
void advance(const TwistSolution& twist, double dt_s, Increment& out);

/// Integrates intervals of a time-ordered sequence of readings, each with its least-squares twist
/// (RP-2). No allocation after construction.
class IncrementIntegrator {
 public:
  IncrementIntegrator(std::shared_ptr<const WheelModel> model, const IncrementOptions& options)
      : options_(options), solver_(std::move(model), options.twist) {}

  const WheelModel& model() const { return solver_.model(); }
  void set_intrinsics(const Intrinsics& x_WI) { solver_.set_intrinsics(x_WI); }

  /// Motion from begin_ns to end_ns in the wheel clock. A reading that is left out is replaced by
  /// the twist of the one before. False when the readings do not reach over the interval.
  bool integrate(std::span<const EncoderSample> samples, std::int64_t begin_ns, std::int64_t end_ns,
                 Increment& out);

 private:
  bool is_believed(const EncoderSample& y, Increment& out);

  IncrementOptions options_;
  TwistSolver solver_;
  TwistSolution solution_;                        ///< of the reading at hand
  TwistSolution believed_;                        ///< of the last one that was not left out
  std::optional<std::int64_t> believed_from_ns_;  ///< in this interval or one before
};

}  // namespace viwo::wheel_relative_pose
