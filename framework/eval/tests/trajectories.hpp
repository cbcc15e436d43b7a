// Trajectories that the tests of this module share.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <random>

#include <Eigen/Geometry>

#include "viwo/math/trajectory.hpp"

namespace viwo::eval {

inline Eigen::Quaterniond about_z(double angle_rad) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()));
}

inline Eigen::Quaterniond random_rotation(std::mt19937_64& random) {
  std::normal_distribution<double> gauss;
  return Eigen::Quaterniond(gauss(random), gauss(random), gauss(random), gauss(random))
      .normalized();
}

inline Eigen::Vector3d random_point(std::mt19937_64& random) {
  std::normal_distribution<double> gauss;
  return {gauss(random), gauss(random), gauss(random)};
}

/// Random poses at 1 s, 2 s, ...
inline Trajectory random_trajectory(int n, std::mt19937_64& random) {
  Trajectory trajectory;
  for (int i = 1; i <= n; ++i) {
    trajectory.push_back(
        {i * std::int64_t{1'000'000'000}, random_point(random), random_rotation(random)});
  }
  return trajectory;
}

/// Constant curvature (1/m, 0: straight) from the origin along +x: a pose every `step_m` and 0.1 s.
inline Trajectory arc(double curvature, double step_m, int n) {
  Trajectory trajectory;
  for (int i = 0; i < n; ++i) {
    const double s = i * step_m;
    const double x = curvature == 0. ? s : std::sin(curvature * s) / curvature;
    const double y = curvature == 0. ? 0. : (1. - std::cos(curvature * s)) / curvature;
    trajectory.push_back({i * std::int64_t{100'000'000}, {x, y, 0.}, about_z(curvature * s)});
  }
  return trajectory;
}

/// The same body in another world: p -> q p + t.
inline Trajectory moved(Trajectory trajectory, const Eigen::Quaterniond& q,
                        const Eigen::Vector3d& t) {
  for (StampedPose& pose : trajectory) {
    pose.p_BinW = q * pose.p_BinW + t;
    pose.q_BtoW = q * pose.q_BtoW;
  }
  return trajectory;
}

}  // namespace viwo::eval
