// What an Update plugin sees of the filter: estimates, first estimates, where their errors stand in
// the error state, and the covariance. Read only; all of it is valid during one call.
//
// Errors: R_GtoI = Exp(-dtheta) R_GtoI_hat, all other quantities add. Columns are positions in the
// error state; -1 stands for a block that is held (no variance, no column).
#pragma once

#include <cstdint>
#include <span>
#include <stdexcept>

#include <Eigen/Core>

#include "viwo/api/block.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/api/rig.hpp"

namespace viwo {

/// Columns of the inertial state; each block has three.
inline constexpr int kThetaColumn = 0;
inline constexpr int kPositionColumn = 3;
inline constexpr int kVelocityColumn = 6;
inline constexpr int kGyroBiasColumn = 9;
inline constexpr int kAccelBiasColumn = 12;
inline constexpr int kImuSize = 15;

/// Pose and velocity of the IMU. `_fej`: where its errors are counted from, and Jacobians are
/// taken; the estimate, or with `estimator.consistency: first_estimates` as it was before the first
/// update that saw it.
struct ImuState {
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
struct CloneState {
  std::int64_t t_ns = 0;  ///< IMU clock
  int slot = 0;           ///< stays the same as long as the clone lives, 0 .. max_clones - 1
  int column = -1;        ///< of dtheta; dp follows
  Eigen::Matrix3d R_GtoI = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinG = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_GtoI_fej = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinG_fej = Eigen::Vector3d::Zero();
  /// How it moved at that time, estimated with what its own epoch measured: for time offsets.
  Eigen::Vector3d w_IinI = Eigen::Vector3d::Zero();  ///< rad/s
  Eigen::Vector3d v_IinG = Eigen::Vector3d::Zero();  ///< m/s
};

/// White noise and bias random walk of the IMU, continuous time.
struct ImuNoise {
  double gyro_rad_per_s_sqrt_hz = 1.6968e-4;
  double accel_m_per_s2_sqrt_hz = 2e-3;
  double gyro_walk_rad_per_s2_sqrt_hz = 1.9393e-5;
  double accel_walk_m_per_s3_sqrt_hz = 3e-3;
};

struct FilterView {
  ImuState imu;
  std::span<const CloneState> clones;  ///< oldest first; the last one is now
  std::span<const BlockView> blocks;   ///< by BlockId::index
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

  const BlockView& block(BlockId id) const { return blocks[static_cast<std::size_t>(id.index)]; }
};

/// Which of an update's streams; given by the host when it is declared.
struct StreamId {
  int index = -1;
};

/// Samples of one kind, side by side.
struct SampleSpan {
  const SampleType* type = nullptr;
  const void* data = nullptr;
  std::size_t size = 0;
};

/// Measurements of one epoch.
struct EpochData {
  std::int64_t begin_ns = 0;            ///< the epoch before this one, or the start, IMU clock
  std::int64_t end_ns = 0;              ///< now; time of the last clone
  std::span<const ImuSample> imu;       ///< from begin to end, both included (interpolated there)
  std::span<const SampleSpan> streams;  ///< by StreamId::index

  /// What the epoch has of a stream (StreamSpec::given). std::logic_error for another kind than was
  /// declared.
  template <Sample T>
  std::span<const T> samples(StreamId id) const {
    const SampleSpan& samples = streams[static_cast<std::size_t>(id.index)];
    if (samples.size == 0) return {};
    if (!(*samples.type == sample_type<T>())) {
      throw std::logic_error("samples of another kind than the stream was declared with");
    }
    return {static_cast<const T*>(samples.data), samples.size};
  }
};

}  // namespace viwo
