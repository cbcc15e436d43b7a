// How good measured poses are, by the IMU that goes with them.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include <Eigen/Core>

#include "viwo/api/measurement.hpp"
#include "viwo/math/trajectory.hpp"

namespace viwo::series {

/// Orientations of a body against the turns that a gyro on it integrates to. Its bias, the mounting
/// and the clock are fitted.
struct BesideGyro {
  double sigma_rad = 0.;  ///< of an orientation, each axis: its part that changes within a second
  std::size_t pairs = 0;  ///< of poses a second apart that were compared
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();   ///< rad/s
  Eigen::Matrix3d R_BtoI = Eigen::Matrix3d::Identity();  ///< body to IMU
  double t_BtoI_s = 0.;                                  ///< t_imu = t_pose + t_BtoI_s
};

/// From a mounting that is roughly right. Nothing where there are fewer than twenty pairs; gaps of
/// poses or IMU are left out, as are outliers.
std::optional<BesideGyro> compare_with_gyro(const Trajectory& poses, std::span<const ImuSample> imu,
                                            const Eigen::Matrix3d& R_BtoI);

/// Where the poses' world has the vertical that the accelerometer has.
struct Vertical {
  double tilt_rad = 0.;   ///< of z of the world off it
  double sigma_rad = 0.;  ///< by what is left of the fit, and the bias that is not known
  double gravity_m_per_s2 = 0.;
  std::size_t windows = 0;
};

/// Gravity in the poses' world by their second differences, with the accelerometer's bias (of
/// `sigma_bias_m_per_s2`) and the place of the body fitted. Nothing with fewer than twenty windows.
std::optional<Vertical> find_vertical(const Trajectory& poses, std::span<const ImuSample> imu,
                                      const BesideGyro& mounting, double sigma_bias_m_per_s2);

}  // namespace viwo::series
