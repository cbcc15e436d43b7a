// Roll, pitch and yaw about fixed axes, as URDF and ROS have them: R = Rz(yaw) Ry(pitch) Rx(roll).
#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace viwo {

inline Eigen::Matrix3d rotation_of_rpy(const Eigen::Vector3d& rpy_rad) {
  return (Eigen::AngleAxisd(rpy_rad.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rpy_rad.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy_rad.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

inline Eigen::Vector3d rpy_of_rotation(const Eigen::Matrix3d& R) {
  const double cos_pitch = std::hypot(R(0, 0), R(1, 0));
  const double pitch = std::atan2(0. - R(2, 0), cos_pitch);
  // Pointing up or down roll and yaw are about one axis.
  if (cos_pitch < 1e-9) return {0., pitch, std::atan2(-R(0, 1), R(1, 1))};
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

}  // namespace viwo
