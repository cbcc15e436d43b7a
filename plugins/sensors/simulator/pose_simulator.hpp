// Fixes of a body on the IMU, as GNSS (its position) or motion capture gives them, with noise: a
// measurement for updates that name the simulator as their sensor.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "viwo/api/host_services.hpp"
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

/// (SIM-10): poses in the middle of each period, in G, in the IMU clock.
inline std::vector<PoseSample> simulate_poses(const sim::BodyTrajectory& trajectory,
                                              const sim::Mounting& mounting,
                                              const PoseParams& params, double duration_s,
                                              std::int64_t start_ns, bool noisy,
                                              const HostServices& services) {
  const double scale = noisy && !services.exact ? 1. : 0.;
  const double sigma_position_m = scale * params.sigma_pose_position_m;
  const double sigma_orientation_rad = scale * params.sigma_pose_orientation_rad;
  const double outlier_probability = services.exact ? 0. : params.pose_outlier_probability;
  const Eigen::Vector3d& rpy = params.pose_rpy_ItoB_rad;
  const Eigen::Matrix3d R_ItoB = sim::rotation_from_euler(rpy.z(), rpy.y(), rpy.x());
  sim::RandomStream noise(services.seed, sim::Stream::kPoseNoise);
  sim::RandomStream outliers(services.seed, sim::Stream::kPoseOutliers);
  std::vector<PoseSample> out;
  if (!(params.pose_rate_hz > 0.)) return out;
  for (std::int64_t k = 0;; ++k) {
    const auto t_ns = static_cast<std::int64_t>(
        std::llround(1e9 * (static_cast<double>(k) + 0.5) / params.pose_rate_hz));
    const double t_s = 1e-9 * static_cast<double>(t_ns);
    if (t_s > duration_s) return out;
    const sim::BodyMotion imu = trajectory.imu(t_s, mounting);
    Eigen::Vector3d turn, shift;
    for (int i = 0; i < 3; ++i) turn[i] = sigma_orientation_rad * noise.gaussian();
    for (int i = 0; i < 3; ++i) shift[i] = sigma_position_m * noise.gaussian();
    if (outliers.uniform() < outlier_probability) {
      for (int i = 0; i < 3; ++i)
        shift[i] += params.pose_outlier_m * (2. * outliers.uniform() - 1.);
    }
    const Eigen::Vector3d p = imu.p_BinG + imu.R_BtoG * params.pose_p_BinI_m + shift;
    const Eigen::Matrix3d R_BtoG = imu.R_BtoG * R_ItoB.transpose() * exp_so3(turn);
    const Eigen::Quaterniond q(R_BtoG);
    out.push_back({start_ns + t_ns, {p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}});
  }
}

}  // namespace viwo
