// What an Update plugin sees of the filter: estimates, first estimates, where their errors stand in
// the error state, and the covariance. Read only; all of it is valid during one call.
//
// Errors: R_GtoI = Exp(-dtheta) R_GtoI_hat, all other quantities add. Columns are positions in the
// error state; -1 stands for a block that is held (no variance, no column).
#pragma once

#include <cstdint>
#include <span>

#include <Eigen/Core>

#include "viwo/api/kinematic_model.hpp"
#include "viwo/api/measurement.hpp"

namespace viwo {

/// Columns of the inertial state; each block has three.
inline constexpr int kThetaColumn = 0;
inline constexpr int kPositionColumn = 3;
inline constexpr int kVelocityColumn = 6;
inline constexpr int kGyroBiasColumn = 9;
inline constexpr int kAccelBiasColumn = 12;
inline constexpr int kImuSize = 15;
/// dtheta, dp of a clone, or of the extrinsics of a camera or of a wheel set.
inline constexpr int kPoseSize = 6;

/// Pose and velocity of the IMU. `_fej`: as it was before the first update that saw it; Jacobians
/// are taken there (equal to the estimate when first estimates are turned off).
struct ImuView {
  Eigen::Matrix3d R_GtoI = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinG = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_IinG = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_GtoI_fej = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinG_fej = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_IinG_fej = Eigen::Vector3d::Zero();
};

/// Pose of the IMU at a past epoch.
struct CloneView {
  std::int64_t t_ns = 0;  ///< IMU clock
  int slot = 0;           ///< stays the same as long as the clone lives, 0 .. max_clones - 1
  int column = -1;        ///< of dtheta; dp follows
  Eigen::Matrix3d R_GtoI = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinG = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_GtoI_fej = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinG_fej = Eigen::Vector3d::Zero();
  /// How it moved at that time, estimated when it was made: for time offsets.
  Eigen::Vector3d w_IinI = Eigen::Vector3d::Zero();  ///< rad/s
  Eigen::Vector3d v_IinG = Eigen::Vector3d::Zero();  ///< m/s
};

enum class CameraDistortion : std::uint8_t { kRadtan, kEquidistant };

/// Camera model and where the camera sits: p_C = R_ItoC p_I + p_IinC.
struct CameraView {
  CameraDistortion distortion = CameraDistortion::kRadtan;
  int width_px = 0;
  int height_px = 0;
  /// fx, fy, cx, cy [px], then the four distortion coefficients in the order of Kalibr.
  Eigen::Matrix<double, 8, 1> intrinsics = Eigen::Matrix<double, 8, 1>::Zero();
  Eigen::Matrix3d R_ItoC = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinC = Eigen::Vector3d::Zero();
  double t_CtoI_s = 0.;        ///< t_imu = t_camera + t_CtoI; stamps of features are in t_imu
  int extrinsics_column = -1;  ///< of dtheta of R_ItoC (same convention as R_GtoI); dp follows
  int intrinsics_column = -1;  ///< of the eight numbers
};

/// A wheel set: its kinematic model, and how its odometry frame O sits on the IMU.
struct WheelsView {
  const KinematicModel* model = nullptr;
  Eigen::Matrix3d R_ItoO = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinO = Eigen::Vector3d::Zero();
  double t_OtoI_s = 0.;  ///< t_imu = t_odom + t_OtoI
  Intrinsics x_WI;
  int extrinsics_column = -1;  ///< of dtheta of R_ItoO (same convention as R_GtoI); dp follows
  int time_offset_column = -1;
  /// Of x_WI[0]; the others follow. Entries held by the gauge have columns, with zero variance.
  int intrinsics_column = -1;
};

/// White noise and bias random walk of the IMU, continuous time.
struct ImuNoise {
  double gyro_rad_per_s_sqrt_hz = 1.7e-4;
  double accel_m_per_s2_sqrt_hz = 2e-3;
  double gyro_walk_rad_per_s2_sqrt_hz = 2e-5;
  double accel_walk_m_per_s3_sqrt_hz = 3e-3;
};

struct FilterView {
  ImuView imu;
  std::span<const CloneView> clones;    ///< oldest first; the last one is now
  std::span<const CameraView> cameras;  ///< in the order of the configuration
  const WheelsView* wheels = nullptr;   ///< the wheel set that this update is for, if any
  ImuNoise imu_noise;
  double gravity_m_per_s2 = 9.81;
  bool oldest_leaves = false;  ///< the oldest clone is dropped after this epoch

  int size = 0;  ///< of the error state
  const double* covariance_data = nullptr;
  int covariance_stride = 0;
  using Covariance = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
  Covariance P() const {
    return {covariance_data, size, size, Eigen::OuterStride<>(covariance_stride)};
  }
};

/// Measurements of one epoch.
struct EpochData {
  std::int64_t begin_ns = 0;  ///< the epoch before this one, IMU clock; 0 for the first
  std::int64_t end_ns = 0;    ///< now; time of the last clone
  std::span<const FeatureSample> features;  ///< images taken now
  std::span<const ImuSample> imu;  ///< from begin to end, both included (interpolated there)
  /// Of the wheel set: everything since the oldest clone that the filter has, in the wheel clock.
  std::span<const EncoderSample> encoders;
  /// Of the sensor that a kPoses update is for: what came since the last epoch, up to now, in time
  /// order. Each sample is given once; one that came late has its old stamp (IMU clock).
  std::span<const PoseSample> poses;
};

}  // namespace viwo
