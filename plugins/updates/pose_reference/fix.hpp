// Pose of a body B on the IMU at an instant between two clones, with its derivatives, and which two
// these are. Equations: model.md beside this file.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "tally.hpp"
#include "viwo/api/filter_view.hpp"

namespace viwo::pose_reference {

/// Pose of the IMU at a clone, and how it moved there.
struct ClonePose {
  Eigen::Matrix3d R_GtoI = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_IinG = Eigen::Vector3d::Zero();
  Eigen::Vector3d w_IinI = Eigen::Vector3d::Zero();  ///< rad/s
  Eigen::Vector3d v_IinI = Eigen::Vector3d::Zero();  ///< velocity relative to G, in I, m/s
};

ClonePose at_estimate(const CloneState& clone);
ClonePose at_first_estimate(const CloneState& clone);

/// Two neighbouring clones, and an instant between them.
struct Bracket {
  const CloneState& first;
  const CloneState& last;
  double period_s;
  double u;  ///< 0 .. 1: the part of the period that has gone then
};

/// Finds the clones around fixes, and counts the fixes that are not between two.
class Brackets {
 public:
  /// Nothing for clones further apart than `max_span_s`.
  std::optional<Bracket> around(std::span<const CloneState> clones, std::int64_t t_ns,
                                double max_span_s);
  void append_to(std::vector<RejectionCount>& out) const;

 private:
  Tally too_late_{"fix that is older than the oldest clone"};
  Tally too_far_{"fix between clones that are too far apart"};
};

/// Where B sits on the IMU.
struct Lever {
  Eigen::Matrix3d R_ItoB = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_BinI = Eigen::Vector3d::Zero();
};

struct BodyPose {
  Eigen::Matrix3d R_GtoB = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_BinG = Eigen::Vector3d::Zero();
};

/// Derivatives of [orientation, position] by dtheta, dp of the first clone, then of the last one;
/// the error of the orientation is R_GtoB = Exp(-dtheta) R_GtoB_hat.
using BodyJacobian = Eigen::Matrix<double, 6, 12>;

/// B at the part `u` (0 .. 1) of the time `period_s` from the first clone to the last one. Rates
/// and velocities are held in the derivatives.
BodyPose body_between(const ClonePose& first, const ClonePose& last, double period_s, double u,
                      const Lever& lever, BodyJacobian* J = nullptr);

}  // namespace viwo::pose_reference
