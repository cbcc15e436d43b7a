// Trajectories: stamped poses in time order, and interpolation between them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "viwo/api/measurement.hpp"
#include "viwo/math/arrays.hpp"

namespace viwo {

/// Pose of body B in world W.
struct StampedPose {
  std::int64_t t_ns = 0;
  Eigen::Vector3d p_BinW = Eigen::Vector3d::Zero();            ///< m
  Eigen::Quaterniond q_BtoW = Eigen::Quaterniond::Identity();  ///< Hamilton, unit norm
};

inline StampedPose stamped_pose(const PoseSample& sample) {
  return {sample.t_ns, to_vector(sample.p_BinW_m), to_quaternion(sample.q_BtoW_xyzw).normalized()};
}

/// In time order, stamps increasing.
using Trajectory = std::vector<StampedPose>;

/// Angle of B's x axis around the z axis of W, rad, in (-pi, pi].
inline double yaw(const Eigen::Quaterniond& q_BtoW) {
  const Eigen::Vector3d x_axis = q_BtoW * Eigen::Vector3d::UnitX();
  return std::atan2(x_axis.y(), x_axis.x());
}

inline double yaw(const StampedPose& pose) { return yaw(pose.q_BtoW); }

/// [yaw, x, y] of B in W, as in se2.hpp.
inline Eigen::Vector3d planar(const StampedPose& pose) {
  return {yaw(pose), pose.p_BinW.x(), pose.p_BinW.y()};
}

/// Whether it has orientations: a prism has none, and gives the same all the time.
inline bool are_turned(const Trajectory& poses) {
  return std::any_of(poses.begin(), poses.end(), [&](const StampedPose& pose) {
    return pose.q_BtoW.angularDistance(poses.front().q_BtoW) > 1e-6;
  });
}

/// The pose at `t_ns`: linear in position, slerp in orientation. Nothing outside of the trajectory,
/// and nothing between two poses that are more than `max_gap_s` apart.
inline std::optional<StampedPose> interpolate(const Trajectory& trajectory, std::int64_t t_ns,
                                              double max_gap_s) {
  const auto after = std::lower_bound(
      trajectory.begin(), trajectory.end(), t_ns,
      [](const StampedPose& pose, std::int64_t stamp) { return pose.t_ns < stamp; });
  if (after == trajectory.end()) return std::nullopt;
  if (after->t_ns == t_ns) return *after;
  if (after == trajectory.begin()) return std::nullopt;
  const auto before = after - 1;
  const double gap_s = seconds_between(before->t_ns, after->t_ns);
  if (gap_s > max_gap_s) return std::nullopt;
  const double ratio = seconds_between(before->t_ns, t_ns) / gap_s;
  return StampedPose{t_ns, before->p_BinW + ratio * (after->p_BinW - before->p_BinW),
                     before->q_BtoW.slerp(ratio, after->q_BtoW)};
}

}  // namespace viwo
