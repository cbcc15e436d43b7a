#include "viwo/sim/body_trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

#include <Eigen/Geometry>

#include "viwo/api/status.hpp"
#include "viwo/math/rpy.hpp"
#include "viwo/math/se2.hpp"

namespace viwo::sim {
namespace {

using Eigen::Vector3d;

/// Samples per knot interval of a motion that is known exactly.
constexpr double kOversampling = 4.;
/// Small against one sample per interval, yet decides where a recording has a gap, and keeps the
/// first and the last interval from following the noise of few samples.
constexpr double kGapSmoothing = 1e-2;

Vector6d raise(const Vector3d& g, const Ground& ground) {
  const Eigen::Vector2d p = g.tail<2>();
  // Slopes along the heading and to its left.
  const Eigen::Vector2d slope = R2(g[0]).transpose() * ground.gradient(p);
  const double roll = std::asin(slope[1] / std::sqrt(1. + slope.squaredNorm()));  // (SIM-5)
  Vector6d out;
  out << p, ground.height(p), g[0], -std::atan(slope[0]), roll;
  return out;
}

Vector6d pose_values(const PoseSample& pose, bool planar, double previous_yaw) {
  const Eigen::Quaterniond q(pose.q_BtoW_xyzw[3], pose.q_BtoW_xyzw[0], pose.q_BtoW_xyzw[1],
                             pose.q_BtoW_xyzw[2]);
  const Eigen::Matrix3d R = q.toRotationMatrix();
  const double heading = std::atan2(R(1, 0), R(0, 0));
  Vector6d out = Vector6d::Zero();
  out[0] = pose.p_BinW_m[0];
  out[1] = pose.p_BinW_m[1];
  out[3] = previous_yaw + wrap_angle(heading - previous_yaw);
  if (planar) return out;
  out[2] = pose.p_BinW_m[2];
  out[4] = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  out[5] = std::atan2(R(2, 1), R(2, 2));
  return out;
}

}  // namespace

Eigen::Matrix3d rotation_from_euler(double yaw, double pitch, double roll) {
  return rotation_of_rpy({roll, pitch, yaw});
}

BodyTrajectory BodyTrajectory::drive(const PlanarMotion& motion, const Ground& ground,
                                     double begin_s, double end_s, double knot_spacing_s,
                                     const SidewaysVelocity& sideways) {
  if (!(begin_s <= 0.) || !(end_s >= 0.) || !(end_s > begin_s) || !(knot_spacing_s > 0.)) {
    throw std::invalid_argument("a trajectory must contain the time 0 and have a knot spacing");
  }
  const Vector3d at_zero = PoseIntegrator(motion, 1e-3, begin_s).advance_to(0.);
  PoseIntegrator integrator(motion, 1e-3, begin_s);
  const auto n =
      static_cast<Eigen::Index>(std::ceil(kOversampling * (end_s - begin_s) / knot_spacing_s));
  std::vector<double> times_s;
  Eigen::Matrix<double, 6, Eigen::Dynamic> values(6, n + 1);
  Eigen::Vector2d slid = Eigen::Vector2d::Zero(), v_before = slid;
  for (Eigen::Index k = 0; k <= n; ++k) {
    const double t_s = begin_s + static_cast<double>(k) * knot_spacing_s / kOversampling;
    times_s.push_back(t_s);
    Vector3d g = between(at_zero, integrator.advance_to(t_s));
    if (sideways) {
      const Eigen::Vector2d v = sideways(t_s) * R2(g[0]).col(1);
      if (k > 0) slid += 0.5 * (v_before + v) * knot_spacing_s / kOversampling;
      v_before = v;
      g.tail<2>() += slid;
    }
    values.col(k) = raise(g, ground);
  }
  return {QuinticSpline::fit(times_s, values, {begin_s, times_s.back(), knot_spacing_s, 0.}),
          end_s};
}

BodyTrajectory BodyTrajectory::through(const std::vector<PoseSample>& poses, std::int64_t origin_ns,
                                       bool planar, double knot_spacing_s) {
  if (poses.size() < 2) throw InputError("a trajectory needs at least two poses");
  std::vector<double> times_s;
  Eigen::Matrix<double, 6, Eigen::Dynamic> values(6, static_cast<Eigen::Index>(poses.size()));
  double yaw = 0.;
  for (const PoseSample& pose : poses) {
    values.col(static_cast<Eigen::Index>(times_s.size())) = pose_values(pose, planar, yaw);
    yaw = values(3, static_cast<Eigen::Index>(times_s.size()));
    times_s.push_back(seconds_between(origin_ns, pose.t_ns));
  }
  return {QuinticSpline::fit(times_s, values,
                             {times_s.front(), times_s.back(), knot_spacing_s, kGapSmoothing}),
          times_s.back()};
}

BodyMotion BodyTrajectory::body(double t_s) const {
  // The last interval of the spline may reach further than what it was fitted to.
  if (t_s > end_s_ + 1e-9) {
    throw std::out_of_range("the trajectory has no time " + std::to_string(t_s) + " s");
  }
  const QuinticSpline::Point at = spline_.at(t_s);
  const double pitch = at.value[4], roll = at.value[5];
  const double sp = std::sin(pitch), cp = std::cos(pitch);
  const double sr = std::sin(roll), cr = std::cos(roll);
  const double dyaw = at.rate[3], dpitch = at.rate[4], droll = at.rate[5];
  BodyMotion out;
  out.R_BtoG = rotation_from_euler(at.value[3], pitch, roll);  // (SIM-1)
  out.p_BinG = at.value.head<3>();
  out.v_BinG = at.rate.head<3>();
  out.a_BinG = at.acceleration.head<3>();
  // Columns: the axes of yaw, pitch and roll in O, and how they move (SIM-6).
  const Vector3d yaw_axis(-sp, cp * sr, cp * cr);
  const Vector3d pitch_axis(0., cr, -sr);
  const Vector3d d_yaw_axis(-cp * dpitch, -sp * sr * dpitch + cp * cr * droll,
                            -sp * cr * dpitch - cp * sr * droll);
  const Vector3d d_pitch_axis(0., -sr * droll, -cr * droll);
  out.w_BwrtG_inB = yaw_axis * dyaw + pitch_axis * dpitch + Vector3d(droll, 0., 0.);
  out.dw_BwrtG_inB = yaw_axis * at.acceleration[3] + pitch_axis * at.acceleration[4] +
                     Vector3d(at.acceleration[5], 0., 0.) + d_yaw_axis * dyaw +
                     d_pitch_axis * dpitch;
  return out;
}

BodyMotion BodyTrajectory::imu(double t_s, const Mounting& mounting) const {
  const BodyMotion base = body(t_s);
  const Vector3d& w = base.w_BwrtG_inB;
  const Vector3d& arm = mounting.p_IinO;
  const Eigen::Matrix3d R_OtoI = mounting.R_ItoO.transpose();
  BodyMotion out;  // (SIM-7)
  out.R_BtoG = base.R_BtoG * mounting.R_ItoO;
  out.p_BinG = base.p_BinG + base.R_BtoG * arm;
  out.v_BinG = base.v_BinG + base.R_BtoG * w.cross(arm);
  out.a_BinG = base.a_BinG + base.R_BtoG * (base.dw_BwrtG_inB.cross(arm) + w.cross(w.cross(arm)));
  out.w_BwrtG_inB = R_OtoI * w;
  out.dw_BwrtG_inB = R_OtoI * base.dw_BwrtG_inB;
  return out;
}

Twist BodyTrajectory::twist(double t_s) const {
  const BodyMotion base = body(t_s);
  const Vector3d v_OwrtG_inO = base.R_BtoG.transpose() * base.v_BinG;
  return {v_OwrtG_inO.x(), v_OwrtG_inO.y(), base.w_BwrtG_inB.z()};
}

FitResidual fit_residual(const BodyTrajectory& trajectory, const std::vector<PoseSample>& poses,
                         std::int64_t origin_ns) {
  FitResidual out;
  for (const PoseSample& pose : poses) {
    const BodyMotion at = trajectory.body(seconds_between(origin_ns, pose.t_ns));
    const double distance = std::hypot(pose.p_BinW_m[0] - at.p_BinG.x(),  //
                                       pose.p_BinW_m[1] - at.p_BinG.y());
    const double yaw = std::atan2(at.R_BtoG(1, 0), at.R_BtoG(0, 0));
    const double turn = wrap_angle(pose_values(pose, true, 0.)[3] - yaw);
    out.rms_m += distance * distance;
    out.max_m = std::max(out.max_m, distance);
    out.rms_rad += turn * turn;
  }
  const auto n = static_cast<double>(std::max<std::size_t>(poses.size(), 1));
  out.rms_m = std::sqrt(out.rms_m / n);
  out.rms_rad = std::sqrt(out.rms_rad / n);
  return out;
}

}  // namespace viwo::sim
