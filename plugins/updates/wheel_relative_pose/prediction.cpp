#include "prediction.hpp"

#include "viwo/math/so3.hpp"

namespace viwo::wheel_relative_pose {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// What prediction and Jacobian share.
struct Geometry {
  Matrix3d D;  ///< G to the first O
  Matrix3d M;  ///< first O to last O
  Vector3d l;  ///< origin of O in I
  Vector3d s;  ///< from the first I to the last O, in G
  Vector3d d;  ///< origin of the last O in the first

  Geometry(const ClonePose& first, const ClonePose& last, const Mount& mount)
      : D(mount.R_ItoO * first.R_GtoI),
        M(mount.R_ItoO * last.R_GtoI * D.transpose()),
        l(-mount.R_ItoO.transpose() * mount.p_IinO),
        s(last.p_IinG - first.p_IinG + last.R_GtoI.transpose() * l),
        d(D * s + mount.p_IinO) {}
};

}  // namespace

Vector3d predict(const ClonePose& first, const ClonePose& last, const Mount& mount) {
  const Geometry g(first, last, mount);
  return {-log_so3(g.M).z(), g.d.x(), g.d.y()};  // (RP-7)
}

PredictionJacobian prediction_jacobian(const ClonePose& first, const ClonePose& last,
                                       const Mount& mount) {
  const Geometry g(first, last, mount);
  const Matrix3d& C = mount.R_ItoO;
  PredictionJacobian J = PredictionJacobian::Zero();

  // (RP-8), yaw: by a rotation a of the last O, M = Exp(-a) M_hat.
  const Eigen::RowVector3d by_a = right_jacobian_inverse_so3(-log_so3(g.M)).row(2);
  const Matrix3d MC = g.M * C;
  J.block<1, 3>(0, kFirstTheta) = -by_a * MC;
  J.block<1, 3>(0, kLastTheta) = by_a * C;
  J.block<1, 3>(0, kMountTheta) = by_a * (Matrix3d::Identity() - g.M);
  J(0, kTimeOffset) = by_a.dot(C * last.w_IinI - MC * first.w_IinI);

  // (RP-8), position.
  const Vector3d s_in_I = first.R_GtoI * g.s;
  const Matrix3d DR1t = g.D * last.R_GtoI.transpose();
  const Vector3d by_t = g.D * (last.v_IinG - first.v_IinG) + DR1t * last.w_IinI.cross(g.l) -
                        C * first.w_IinI.cross(s_in_I);
  J.block<2, 3>(1, kFirstTheta) = (C * skew(s_in_I)).topRows<2>();
  J.block<2, 3>(1, kFirstPosition) = -g.D.topRows<2>();
  J.block<2, 3>(1, kLastTheta) = -(DR1t * skew(g.l)).topRows<2>();
  J.block<2, 3>(1, kLastPosition) = g.D.topRows<2>();
  J.block<2, 3>(1, kMountTheta) =
      (skew(g.d - mount.p_IinO) + g.M.transpose() * skew(mount.p_IinO)).topRows<2>();
  J.block<2, 3>(1, kMountPosition) = (Matrix3d::Identity() - g.M.transpose()).topRows<2>();
  J.block<2, 1>(1, kTimeOffset) = by_t.head<2>();
  return J;
}

}  // namespace viwo::wheel_relative_pose
