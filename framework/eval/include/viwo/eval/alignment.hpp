// Alignment: the rigid transform that brings an estimate, whose world is arbitrary, onto a
// reference.
#pragma once

#include <span>
#include <string_view>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "viwo/eval/association.hpp"
#include "viwo/math/trajectory.hpp"

namespace viwo::eval {

enum class Alignment {
  kNone,         ///< the worlds are the same
  kStart,        ///< the first common poses coincide
  kYawPosition,  ///< 4 dof: least squares over the positions; gravity is known to both
  kSe3,          ///< 6 dof: least squares over the positions
};

/// "none", "start", "yaw_position", "se3".
std::string_view name(Alignment alignment);

/// World E of the estimate in world R of the reference.
struct RigidTransform {
  Eigen::Quaterniond q_EtoR = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p_EinR = Eigen::Vector3d::Zero();

  /// A pose given in E, in R.
  StampedPose operator*(const StampedPose& pose_inE) const;
};

/// The transform that minimises the squared position differences (kYawPosition, kSe3), in closed
/// form.
///
/// When the robot hardly moved (horizontal spread of either below 5 cm rms), positions say nothing
/// about the yaw; kYawPosition then takes the yaw that fits the orientations best. kSe3 throws
/// InputError when the positions are in one point or on one line, where it is not determined.
/// `pairs` must not be empty (std::invalid_argument).
RigidTransform align(std::span<const PosePair> pairs, Alignment alignment);

}  // namespace viwo::eval
