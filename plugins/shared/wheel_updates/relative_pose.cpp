#include "relative_pose.hpp"

#include "viwo/math/se2.hpp"
#include "viwo/math/so3.hpp"

namespace viwo::wheel_motion {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// What prediction and Jacobian share.
struct Geometry {
  Matrix3d E0, E1;  ///< turn of the IMU from clone to instant
  Matrix3d D;       ///< G to O at the first instant
  Matrix3d M;       ///< O at the first instant to O at the last one
  Vector3d l;       ///< origin of O in I
  Vector3d b1;      ///< origin of O at the last instant, in I at the last clone
  Vector3d s;       ///< the same seen from the first clone, in G
  Vector3d y;       ///< from I to O at the last instant, in I at the first one
  Vector3d d;       ///< origin of O at the last instant, in O at the first one

  Geometry(const MovingPose& first, const MovingPose& last, const Extrinsics& mount)
      : E0(exp_so3(-first.after_s * first.w_IinI)), E1(exp_so3(-last.after_s * last.w_IinI)) {
    const Matrix3d& C = mount.R_ItoO;
    D = C * E0 * first.R_GtoI;
    M = C * E1 * last.R_GtoI * D.transpose();  // (WO-3)
    l = -C.transpose() * mount.p_IinO;
    b1 = last.v_IinI * last.after_s + E1.transpose() * l;
    s = last.p_IinG - first.p_IinG + last.R_GtoI.transpose() * b1;
    y = E0 * (first.R_GtoI * s - first.v_IinI * first.after_s);
    d = C * y + mount.p_IinO;  // (WO-4)
  }
};

}  // namespace

MovingPose moving_pose(const CloneState& clone, double after_s, bool first_estimate) {
  return {first_estimate ? clone.R_GtoI_fej : clone.R_GtoI,
          first_estimate ? clone.p_IinG_fej : clone.p_IinG, clone.w_IinI,
          clone.R_GtoI_fej * clone.v_IinG, after_s};
}

Eigen::Vector3d relative_pose(const MovingPose& first, const MovingPose& last,
                              const Extrinsics& mount, Eigen::Vector2d* tilt) {
  const Geometry g(first, last, mount);
  const Vector3d turn = -log_so3(g.M);
  if (tilt != nullptr) *tilt = turn.head<2>();
  return {turn.z(), g.d.x(), g.d.y()};  // (WO-5)
}

PoseJacobian relative_pose_jacobian(const MovingPose& first, const MovingPose& last,
                                    const Extrinsics& mount) {
  const Geometry g(first, last, mount);
  const Matrix3d& C = mount.R_ItoO;
  PoseJacobian J = PoseJacobian::Zero();

  // Yaw: M = Exp(-a) M_hat changes it by e3^T Jl^-1(Log M) a; the left Jacobian is Jr(-phi).
  const Eigen::RowVector3d by_a = right_jacobian_inverse_so3(-log_so3(g.M)).row(2);  // (WO-6)
  const Matrix3d CE1 = C * g.E1;
  const Matrix3d MCE0 = g.M * C * g.E0;
  J.block<1, 3>(0, kFirstTheta) = -by_a * MCE0;
  J.block<1, 3>(0, kLastTheta) = by_a * CE1;
  J(0, kTimeOffset) = by_a.dot(CE1 * last.w_IinI - MCE0 * first.w_IinI);

  // Position, (WO-7).
  const Matrix3d DR1t = g.D * last.R_GtoI.transpose();
  J.block<2, 3>(1, kFirstTheta) = (C * g.E0 * skew(first.R_GtoI * g.s)).topRows<2>();
  J.block<2, 3>(1, kFirstPosition) = -g.D.topRows<2>();
  J.block<2, 3>(1, kLastTheta) = -(DR1t * skew(g.b1)).topRows<2>();
  J.block<2, 3>(1, kLastPosition) = g.D.topRows<2>();
  const Vector3d by_t = -C * (first.w_IinI.cross(g.y) + g.E0 * first.v_IinI) +
                        DR1t * (last.v_IinI + g.E1.transpose() * last.w_IinI.cross(g.l));
  J.block<2, 1>(1, kTimeOffset) = by_t.head<2>();
  J.middleCols<6>(kMountTheta) = mount_jacobian({g.M, g.d}, mount.p_IinO);
  return J;
}

Motion complete_motion(const Vector3d& g, const Eigen::Vector2d& tilt) {
  // The planar twist that the wheels integrated, and the same with roll and pitch (WO-12).
  const Vector3d planar = log_se2(g);
  const Vector3d turn(tilt.x(), tilt.y(), planar[0]);
  return {exp_so3(-turn), right_jacobian_so3(-turn) * Vector3d(planar[1], planar[2], 0.)};
}

Eigen::Matrix<double, 3, 6> mount_jacobian(const Motion& motion, const Vector3d& p_IinO) {
  const Matrix3d& M = motion.M;
  Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
  const Eigen::RowVector3d by_a = right_jacobian_inverse_so3(-log_so3(M)).row(2);  // (WO-6)
  J.block<1, 3>(0, 0) = by_a * (Matrix3d::Identity() - M);
  J.block<2, 3>(1, 0) =
      (skew(motion.d - p_IinO) + M.transpose() * skew(p_IinO)).topRows<2>();  // (WO-7)
  J.block<2, 3>(1, 3) = (Matrix3d::Identity() - M.transpose()).topRows<2>();
  return J;
}

CalibrationJacobian calibration_jacobian(const Vector3d& g, const Eigen::Vector2d& tilt,
                                         const Vector3d& g_rate, const Vector3d& p_IinO) {
  CalibrationJacobian J;
  J.leftCols<6>() = mount_jacobian(complete_motion(g, tilt), p_IinO);
  // Where O is on the base cannot be told: exactly so, as the intrinsics do not know of tilts.
  J.middleCols<3>(2) =
      mount_jacobian(complete_motion(g, Eigen::Vector2d::Zero()), p_IinO).middleCols<3>(2);
  J.col(6) = g_rate;
  return J;
}

Eigen::Matrix<double, 2, kGeometrySize> tilt_jacobian(const MovingPose& first,
                                                      const MovingPose& last,
                                                      const Extrinsics& mount) {
  const Matrix3d& C = mount.R_ItoO;
  Eigen::Matrix<double, 2, kGeometrySize> J = Eigen::Matrix<double, 2, kGeometrySize>::Zero();
  J.middleCols<3>(kFirstTheta) = -(C * last.R_GtoI * first.R_GtoI.transpose()).topRows<2>();
  J.middleCols<3>(kLastTheta) = C.topRows<2>();
  return J;
}

}  // namespace viwo::wheel_motion
