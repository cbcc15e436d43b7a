// Orientations of poses that are read otherwise than they were written.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/checks/finding.hpp"
#include "viwo/series/rate_grid.hpp"
#include "viwo/series/recording.hpp"

namespace viwo::inspect {

/// Turns about an axis of the world, as z, of a pose source.
std::vector<series::Turn> turns_about(const Trajectory& poses,
                                      const Eigen::Vector3d& axis = Eigen::Vector3d::UnitZ());

/// Whether the orientations of `poses` cannot be compared with `turns` about the vertical, as z, of
/// `other`, and tells why: there are none, or they turn as those do in another order of the
/// quaternion, or about another axis than z.
bool has_other_orientation(const Trajectory& poses, const std::string& label,
                           const std::vector<series::Turn>& turns, const std::string& other,
                           Findings& out);

}  // namespace viwo::inspect
