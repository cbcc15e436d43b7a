// The factor of one interval: what the measured pose says of its states, to first order at a point
// (WO-8), and what that leaves out, as noise. Equations: model.md beside this file.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "ground_tilt.hpp"
#include "hidden_turn.hpp"
#include "instrument.hpp"
#include "interval.hpp"
#include "small_turn.hpp"
#include "wheel_odometry_params.hpp"

namespace viwo::wheel_odometry {

using Step = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxColumns, 1>;
using Jacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxColumns>;

/// What the intervals before tell of one that follows.
struct Memory {
  GroundTilt tilt;
  SmallTurn turn;
  HiddenTurn hidden;
};

/// A factor at a point.
struct Linearised {
  Eigen::Vector3d residual = Eigen::Vector3d::Zero();
  Jacobian H;
  Eigen::Matrix3d R = Eigen::Matrix3d::Zero();
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();     ///< [roll, pitch] of O over the interval
  Eigen::Vector3d lasting = Eigen::Vector3d::Zero();  ///< variance of the pose by the intrinsics

  /// Of a residual, squared, in units of the noise.
  double size_of(const Eigen::Vector3d& r) const { return r.dot(R.llt().solve(r)); }
};

/// Of what the wheels measured over an interval (WO-9).
Eigen::Matrix3d measurement_noise(const Params& params, const PreintegratedPose& pose);

/// What it is made with must outlive it.
class IntervalFactor {
 public:
  IntervalFactor(const Params& params, const Memory& before, const Interval& interval)
      : params_(params), before_(before), interval_(interval) {}

  const Interval& interval() const { return interval_; }

  /// (WO-8) for what the wheels measured with the intrinsics of that point.
  Linearised linearise(const Point& at, const PreintegratedPose& pose) const;

  /// The interval's first point (+) step.
  Point moved(const Step& step) const;

  /// (WO-11), for the mount and the time offset, crossed with all of the geometry.
  void add_second_order_noise(const Point& at, Eigen::Matrix3d& R) const;

  /// Of the roll, or the pitch, of O from one clone to the other.
  double tilt_variance(const Point& at) const;

 private:
  /// The column of the yaw of the mount: `measured`, or such that a turn of O that the wheels hide
  /// changes nothing (WO-22).
  Eigen::Vector3d hidden_yaw(const IntrinsicJacobian& J_g_WI,
                             const wheel_motion::CalibrationJacobian& measured,
                             const Eigen::Vector3d& p_IinO) const;
  template <class Vector, class Variance>
  Vector moving_part(const Vector& measured, const Variance& variance) const;
  Eigen::Vector3d planar_part(const Eigen::Vector3d& g, const Eigen::Vector3d& variance) const;

  const Params& params_;
  const Memory& before_;
  const Interval& interval_;
};

}  // namespace viwo::wheel_odometry
