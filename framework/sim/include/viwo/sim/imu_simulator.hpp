// An inertial measurement unit on a trajectory.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/filter_view.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/sim/body_trajectory.hpp"

namespace viwo::sim {

struct ImuSimulation {
  double duration_s = 60.;
  double rate_hz = 200.;
  std::int64_t start_ns = 0;  ///< stamp of time 0 of the trajectory, and of the first sample
  double gravity_m_per_s2 = 9.81;
  bool noise = true;  ///< white noise, bias walk and the drawn part of the first biases
  ImuNoise densities;
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();   ///< of the first sample, rad/s ...
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();  ///< ... and m/s^2
  double sigma_gyro_bias_rad_per_s = 0.;                 ///< added to them, drawn
  double sigma_accel_bias_m_per_s2 = 0.;
};

/// Biases of one sample.
struct ImuBias {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();
};

struct SimulatedImu {
  std::vector<ImuSample> samples;
  std::vector<ImuBias> biases;  ///< that are in the samples, one each
};

/// How long the trajectory must be for an IMU that runs for options.duration_s: its last sample is
/// the first one at or behind the duration.
double imu_end_s(const ImuSimulation& options);

/// Samples at k / rate_hz, exact at their instants: w + bias + noise and
/// R_GtoI (a_I + [0 0 g]) + bias + noise. White noise of a sample is sigma sqrt(rate), biases walk
/// by sigma / sqrt(rate) between samples.
SimulatedImu simulate_imu(const BodyTrajectory& trajectory, const Mounting& mounting,
                          const ImuSimulation& options, std::uint64_t seed);

/// True state of the IMU at `t_ns`, biases interpolated between the samples.
StateSample true_state(const BodyTrajectory& trajectory, const Mounting& mounting,
                       const SimulatedImu& imu, std::int64_t start_ns, std::int64_t t_ns);

}  // namespace viwo::sim
