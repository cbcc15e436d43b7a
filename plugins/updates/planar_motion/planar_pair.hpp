// How far two poses of the odometry frame O are from lying on one plane, with derivatives by the
// poses of the IMU and by its mount. Equations: model.md beside this file.
#pragma once

#include <Eigen/Core>

namespace viwo::planar_motion {

struct ImuPose {
  Eigen::Matrix3d R_GtoI = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinG = Eigen::Vector3d::Zero();
};

/// Where the IMU sits in O.
struct Extrinsics {
  Eigen::Matrix3d R_ItoO = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinO = Eigen::Vector3d::Zero();
};

/// Rows: roll and pitch that O turns by (rad, in the axes of O), how far O moves along its own z
/// axis (m), and how far it moves up in G (m).
inline constexpr int kRows = 4;
/// Columns: dtheta, dp of the first pose, of the last pose, dtheta of R_ItoO. The origin p_IinO has
/// none: motion on a plane says nothing about it.
inline constexpr int kColumns = 15;
using Rows = Eigen::Matrix<double, kRows, 1>;
using PairJacobian = Eigen::Matrix<double, kRows, kColumns>;

/// What is off the plane between two poses; `path_m`, if not null, becomes the distance that O
/// moves along the plane.
Rows off_plane(const ImuPose& first, const ImuPose& last, const Extrinsics& mount,
               double* path_m = nullptr);

/// Its derivative by the errors of the two poses (R = Exp(-dtheta) R_hat): the first twelve
/// columns.
void poses_jacobian(const ImuPose& first, const ImuPose& last, const Extrinsics& mount,
                    PairJacobian& J);

/// The columns of the mount: those of the motion along the plane that is next to the given one, so
/// that noise of the poses does not count as motion off the plane.
void mount_jacobian(const ImuPose& first, const ImuPose& last, const Extrinsics& mount,
                    PairJacobian& J);

}  // namespace viwo::planar_motion
