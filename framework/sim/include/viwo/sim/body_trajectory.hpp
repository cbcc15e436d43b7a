// A smooth trajectory of a base in space: O in G over time, and what an IMU mounted on it does.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/kinematic_model.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/sim/ground.hpp"
#include "viwo/sim/planar_motion.hpp"
#include "viwo/sim/quintic_spline.hpp"

namespace viwo::sim {

/// Motion of a frame B in G, all of it at one instant.
struct BodyMotion {
  Eigen::Matrix3d R_BtoG = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_BinG = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_BinG = Eigen::Vector3d::Zero();        ///< m/s
  Eigen::Vector3d a_BinG = Eigen::Vector3d::Zero();        ///< m/s^2, gravity not in it
  Eigen::Vector3d w_BwrtG_inB = Eigen::Vector3d::Zero();   ///< rad/s
  Eigen::Vector3d dw_BwrtG_inB = Eigen::Vector3d::Zero();  ///< its time derivative, rad/s^2
};

/// How the IMU sits on the base.
struct Mounting {
  Eigen::Matrix3d R_ItoO = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinO = Eigen::Vector3d::Zero();
};

/// What is added to the v_y of a motion at a time, m/s: how its base slides. Empty: nothing.
using SidewaysVelocity = std::function<double(double t_s)>;

/// R_OtoG of yaw, pitch and roll: Rz(yaw) Ry(pitch) Rx(roll).
Eigen::Matrix3d rotation_from_euler(double yaw, double pitch, double roll);

/// O in G as a quintic spline in x, y, z, yaw, pitch, roll; |pitch| must stay below pi/2.
/// Immutable, so calls may be concurrent.
class BodyTrajectory {
 public:
  /// A motion whose horizontal path is driven on `ground`: O is on the ground, its z axis normal
  /// to it, its x axis above the heading. The pose is over the origin with heading zero at t = 0.
  /// Between begin_s <= 0 and end_s >= 0 of the motion. The spline follows the motion closely
  /// (below 1e-6 m with the default) and is the truth from then on. What the base has slid before
  /// t = 0 is left in the pose.
  static BodyTrajectory drive(const PlanarMotion& motion, const Ground& ground, double begin_s,
                              double end_s, double knot_spacing_s = 0.05,
                              const SidewaysVelocity& sideways = {});

  /// Least squares through poses at their stamps; time 0 is `origin_ns`. `planar`: only x, y and
  /// yaw are used, z, pitch and roll are zero. Its derivatives are poor within one knot spacing of
  /// both ends. InputError for less than two poses.
  static BodyTrajectory through(const std::vector<PoseSample>& poses, std::int64_t origin_ns,
                                bool planar, double knot_spacing_s);

  double begin_s() const { return spline_.begin_s(); }
  double end_s() const { return end_s_; }

  /// std::out_of_range outside of begin_s() .. end_s(), as for all that follow.
  BodyMotion body(double t_s) const;
  /// The IMU's motion.
  BodyMotion imu(double t_s, const Mounting& mounting) const;
  /// [v_x, v_y, omega_z] of O in O: what wheels at O's height see. Exactly that of body().
  Twist twist(double t_s) const;

 private:
  BodyTrajectory(QuinticSpline spline, double end_s) : spline_(std::move(spline)), end_s_(end_s) {}

  QuinticSpline spline_;
  double end_s_;
};

/// How far poses are from the trajectory that was fitted through them.
struct FitResidual {
  double rms_m = 0.;
  double max_m = 0.;
  double rms_rad = 0.;  ///< of the yaw
};

/// In x, y and yaw.
FitResidual fit_residual(const BodyTrajectory& trajectory, const std::vector<PoseSample>& poses,
                         std::int64_t origin_ns);

}  // namespace viwo::sim
