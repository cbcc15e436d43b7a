// What wheel_odometry knows of an interval before it linearises its factor. Equations: model.md
// beside this file.
#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>

#include "relative_pose.hpp"
#include "viwo/api/update.hpp"

namespace viwo::wheel_odometry {

inline constexpr int kMaxColumns = wheel_motion::kGeometrySize + 2 * kMaxIntrinsics;
static_assert(kMaxColumns <= kMaxFactorColumns);
using GeometryMatrix =
    Eigen::Matrix<double, wheel_motion::kGeometrySize, wheel_motion::kGeometrySize>;

inline double square(double x) { return x * x; }

/// Where a factor is linearised.
struct Point {
  wheel_motion::MovingPose first, last;
  wheel_motion::Extrinsics mount;
  Intrinsics x_WI;
};

/// How the measured pose changes when both instants move on (WO-13).
struct Rate {
  Eigen::Vector3d g = Eigen::Vector3d::Zero();         ///< rad/s, m/s
  Eigen::Vector3d variance = Eigen::Vector3d::Zero();  ///< of the noise of each entry
};

/// The states that a factor is about, and their prior.
struct States {
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxColumns,
                               kMaxColumns>;

  /// The factor's leading columns in a PoseJacobian; the intrinsics follow them.
  std::array<int, wheel_motion::kGeometrySize> geometry{};
  int n_geometry = 0;
  Square P;                                            ///< what wanders is in the intrinsics
  GeometryMatrix geometry_P = GeometryMatrix::Zero();  ///< of the geometry, zero where held

  Eigen::Index n_intrinsics() const { return P.cols() - n_geometry; }
  int geometry_at(int k) const { return geometry[static_cast<std::size_t>(k)]; }
};

/// Those of an interval that the filter estimates; their columns are added to `columns`.
States add_states(const WheelsView& wheels, const FilterView::Covariance& P,
                  const CloneState& first, const CloneState& last, FactorColumns& columns);

/// What stays while a factor is linearised again and again.
struct Interval {
  Point start;                                   ///< prior estimate
  wheel_motion::MovingPose first_fej, last_fej;  ///< first estimates, for the Jacobian
  Rate rate;
  States states;
  std::optional<Intrinsics> by_yaw;  ///< how they change with the yaw of another O (WO-22)
  Eigen::Matrix3d curvature_noise = Eigen::Matrix3d::Zero();  ///< (WO-18)
};

}  // namespace viwo::wheel_odometry
