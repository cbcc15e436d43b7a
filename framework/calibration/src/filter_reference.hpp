// The trajectory that a filter finds without its wheels, as what the wheels are compared with.
#pragma once

#include "viwo/config/node.hpp"
#include "viwo/math/trajectory.hpp"
#include "viwo/plugin_host/registry.hpp"

namespace viwo::calibration {

/// Poses of I by the filter of a run without placeholders, its updates of wheels turned off.
/// `where` begins messages: "recording 'NAME'". Throws InputError when nothing is left that could
/// tell how the robot moved, or when the filter loses its way.
Trajectory poses_of_filter(const config::Node& run, const std::string& where,
                           PluginRegistry& plugins);

}  // namespace viwo::calibration
