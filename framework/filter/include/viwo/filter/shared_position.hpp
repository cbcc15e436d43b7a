// Where all of it is: the part of the start's position that every pose has, and no relative
// measurement sees, kept out of the covariance where it is so large that digits would be lost.
#pragma once

#include <span>

#include <Eigen/Core>

#include "viwo/api/filter_view.hpp"
#include "viwo/api/update.hpp"
#include "viwo/filter/covariance.hpp"

namespace viwo {

class SharedPosition {
 public:
  /// Takes what exceeds (10 m)^2 out of the position block of a prior (F-41).
  void take_from(Eigen::Ref<Eigen::Matrix3d> P_position);
  /// What is left out, m^2.
  const Eigen::Matrix3d& covariance() const { return P_; }
  bool is_zero() const { return P_.isZero(0.); }

  /// Whether a factor would change if all poses were moved together.
  bool is_seen_by(const ResidualFactor& factor, std::span<const CloneState> clones) const;
  bool is_seen_by(const InformationFactor& factor, std::span<const CloneState> clones) const;
  /// Puts it back, into the position of every pose.
  void return_to(Covariance& covariance, std::span<const CloneState> clones);

 private:
  Eigen::Matrix3d P_ = Eigen::Matrix3d::Zero();
};

}  // namespace viwo
