// Directions that theory says cannot be observed, to be compared with the null space that comes
// out. Equations: docs/observability.md.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/observability/observability_matrix.hpp"
#include "viwo/wheel/wheel_model.hpp"

namespace viwo {

struct NamedDirections {
  std::string name;
  Eigen::MatrixXd basis;  ///< columns in the units of the state, not orthonormal
  std::string when;       ///< which motions are said to hide them, in words
};

// Of what is not estimated nothing is in a basis; sets that are left empty are not returned.

/// Global position and yaw (OB-5); tilt with accelerometer bias (OB-9); the distance of the
/// feature.
std::vector<NamedDirections> directions_of_the_robot(const ObservabilityMatrix& state,
                                                     double gravity_m_per_s2);

/// With free gauge entries the placement of O (OB-6); of the mount and clock: lever arm, its part
/// along a vertical axis, tilt on flat ground (OB-8), time offset; all of the calibration. For
/// wheels that steer (intrinsics r_j, x_j, y_j, delta_oj): wheel positions, steering offsets, each
/// wheel that does not roll, and the two directions per wheel of a constant steering configuration,
/// taken at `sample` (OB-7), which must be theirs and of the motion at hand.
std::vector<NamedDirections> directions_of_wheels(const ObservabilityMatrix& state,
                                                  const WheelsView& wheels, const WheelModel& model,
                                                  const EncoderSample& sample);

}  // namespace viwo
