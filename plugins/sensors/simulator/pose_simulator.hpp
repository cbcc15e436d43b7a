// Fixes of a body on the IMU, as GNSS (its position) or motion capture gives them, with noise: a
// measurement for updates that name the simulator as their sensor.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "viwo/api/measurement.hpp"
#include "viwo/api/params.hpp"
#include "viwo/api/status.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/sim/body_trajectory.hpp"
#include "viwo/sim/random.hpp"

namespace viwo {

struct PoseParams {
  double pose_rate_hz = 0.;
  double sigma_pose_position_m = 0.02;
  double sigma_pose_orientation_rad = 0.01;
  Eigen::Vector3d pose_p_BinI_m{0., 0., 0.};
  Eigen::Vector3d pose_rpy_ItoB_rad{0., 0., 0.};
  double pose_outlier_probability = 0.;
  double pose_outlier_m = 2.;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(pose_rate_hz), {.unit = "Hz",
                                 .min = 0.,
                                 .max = 10000.,
                                 .help = "rate of noisy poses of a body B on the IMU, for updates "
                                         "that measure with poses; 0: none"});
    b(VIWO_PARAM(sigma_pose_position_m),
      {.unit = "m", .min = 0., .help = "noise of their position, per axis"});
    b(VIWO_PARAM(sigma_pose_orientation_rad),
      {.unit = "rad", .min = 0., .help = "noise of their orientation, per axis of B"});
    b(VIWO_PARAM(pose_p_BinI_m), {.unit = "m", .help = "where B is seen from the IMU"});
    b(VIWO_PARAM(pose_rpy_ItoB_rad),
      {.unit = "rad",
       .min = -3.2,
       .max = 3.2,
       .help = "how the IMU is turned in B: R_ItoB = Rz(third) Ry(second) Rx(first)"});
    b(VIWO_PARAM(pose_outlier_probability),
      {.min = 0., .max = 1., .help = "probability that a position is off"});
    b(VIWO_PARAM(pose_outlier_m), {.unit = "m", .min = 0., .help = "by up to how much, each axis"});
  }
};

struct PoseSimulation {
  double duration_s = 0.;
  std::int64_t start_ns = 0;
  double rate_hz = 0.;
  double sigma_position_m = 0.;
  double sigma_orientation_rad = 0.;
  double outlier_probability = 0.;
  double outlier_m = 0.;
  Eigen::Matrix3d R_ItoB = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_BinI = Eigen::Vector3d::Zero();
};

inline PoseSimulation pose_simulation_from(const PoseParams& params, double duration_s,
                                           std::int64_t start_ns, bool noisy, bool exact) {
  PoseSimulation out;
  out.duration_s = duration_s;
  out.start_ns = start_ns;
  out.rate_hz = params.pose_rate_hz;
  const double noise = noisy && !exact ? 1. : 0.;
  out.sigma_position_m = noise * params.sigma_pose_position_m;
  out.sigma_orientation_rad = noise * params.sigma_pose_orientation_rad;
  out.outlier_probability = exact ? 0. : params.pose_outlier_probability;
  out.outlier_m = params.pose_outlier_m;
  const Eigen::Vector3d& rpy = params.pose_rpy_ItoB_rad;
  out.R_ItoB = sim::rotation_from_euler(rpy.z(), rpy.y(), rpy.x());
  out.p_BinI = params.pose_p_BinI_m;
  return out;
}

/// (SIM-10): poses in the middle of each period, in G, in the IMU clock.
inline std::vector<PoseSample> simulate_poses(const sim::BodyTrajectory& trajectory,
                                              const sim::Mounting& mounting,
                                              const PoseSimulation& simulation,
                                              std::uint64_t seed) {
  sim::RandomStream noise(seed, sim::Stream::kPoseNoise);
  sim::RandomStream outliers(seed, sim::Stream::kPoseOutliers);
  std::vector<PoseSample> out;
  if (!(simulation.rate_hz > 0.)) return out;
  for (std::int64_t k = 0;; ++k) {
    const auto t_ns = static_cast<std::int64_t>(
        std::llround(1e9 * (static_cast<double>(k) + 0.5) / simulation.rate_hz));
    const double t_s = 1e-9 * static_cast<double>(t_ns);
    if (t_s > simulation.duration_s) return out;
    const sim::BodyMotion imu = trajectory.imu(t_s, mounting);
    Eigen::Vector3d turn, shift;
    for (int i = 0; i < 3; ++i) turn[i] = simulation.sigma_orientation_rad * noise.gaussian();
    for (int i = 0; i < 3; ++i) shift[i] = simulation.sigma_position_m * noise.gaussian();
    if (outliers.uniform() < simulation.outlier_probability) {
      for (int i = 0; i < 3; ++i) shift[i] += simulation.outlier_m * (2. * outliers.uniform() - 1.);
    }
    const Eigen::Vector3d p = imu.p_BinG + imu.R_BtoG * simulation.p_BinI + shift;
    const Eigen::Matrix3d R_BtoG = imu.R_BtoG * simulation.R_ItoB.transpose() * exp_so3(turn);
    const Eigen::Quaterniond q(R_BtoG);
    out.push_back(
        {simulation.start_ns + t_ns, {p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}});
  }
}

}  // namespace viwo
