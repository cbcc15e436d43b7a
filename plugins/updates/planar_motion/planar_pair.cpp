#include "planar_pair.hpp"

#include "viwo/math/so3.hpp"

namespace viwo::planar_motion {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// What prediction and Jacobian share.
struct Geometry {
  Matrix3d D0, D1;  ///< G to O
  Matrix3d M;       ///< first O to last O
  Vector3d l;       ///< origin of O in I
  Vector3d s;       ///< origin of the last O in G, from the first IMU
  Vector3d up;      ///< how O moves in G
  Vector3d d;       ///< the same in the first O

  Geometry(const ImuPose& first, const ImuPose& last, const Extrinsics& mount)
      : D0(mount.R_ItoO * first.R_GtoI), D1(mount.R_ItoO * last.R_GtoI) {
    M = D1 * D0.transpose();  // (PM-1)
    l = -mount.R_ItoO.transpose() * mount.p_IinO;
    s = last.p_IinG - first.p_IinG + last.R_GtoI.transpose() * l;
    up = s - first.R_GtoI.transpose() * l;
    d = D0 * up;  // (PM-2)
  }
};

}  // namespace

Rows off_plane(const ImuPose& first, const ImuPose& last, const Extrinsics& mount, double* path_m) {
  const Geometry g(first, last, mount);
  if (path_m != nullptr) *path_m = g.d.head<2>().norm();
  const Vector3d turn = -log_so3(g.M);
  return {turn.x(), turn.y(), g.d.z(), g.up.z()};  // (PM-3)
}

void poses_jacobian(const ImuPose& first, const ImuPose& last, const Extrinsics& mount,
                    PairJacobian& J) {
  const Geometry g(first, last, mount);
  const Matrix3d& C = mount.R_ItoO;
  J.leftCols<12>().setZero();

  // (PM-4); the left Jacobian is Jr(-phi).
  const Eigen::Matrix<double, 2, 3> by_a = right_jacobian_inverse_so3(-log_so3(g.M)).topRows<2>();
  J.block<2, 3>(0, 0) = -by_a * g.M * C;
  J.block<2, 3>(0, 6) = by_a * C;
  // (PM-5)
  const Matrix3d R0t = first.R_GtoI.transpose();
  const Matrix3d R1t = last.R_GtoI.transpose();
  const Eigen::RowVector3d z = g.D0.row(2);
  J.block<1, 3>(2, 0) = C.row(2) * skew(first.R_GtoI * g.s);
  J.block<1, 3>(2, 3) = -z;
  J.block<1, 3>(2, 6) = -z * R1t * skew(g.l);
  J.block<1, 3>(2, 9) = z;
  // (PM-6)
  J.block<1, 3>(3, 0) = (R0t * skew(g.l)).row(2);
  J(3, 5) = -1.;
  J.block<1, 3>(3, 6) = -(R1t * skew(g.l)).row(2);
  J(3, 11) = 1.;
}

void mount_jacobian(const ImuPose& first, const ImuPose& last, const Extrinsics& mount,
                    PairJacobian& J) {
  const Geometry g(first, last, mount);
  J.rightCols<3>().setZero();
  // (PM-7)
  const double yaw = -log_so3(g.M).z();
  const Matrix3d turned = exp_so3({0., 0., -yaw});
  const Matrix3d by_c = right_jacobian_inverse_so3({0., 0., yaw}) * (Matrix3d::Identity() - turned);
  J.block<2, 3>(0, 12) = by_c.topRows<2>();
  J(2, 12) = -g.d.y();
  J(2, 13) = g.d.x();
}

}  // namespace viwo::planar_motion
