// What explains trajectories that differ by far more than an odometry does.
#pragma once

#include <string>
#include <vector>

#include "viwo/eval/accuracy.hpp"

namespace viwo::eval {

/// Root mean square distance of a trajectory from its middle.
double extent_m(const Trajectory& poses);

/// From pose to pose.
double way_m(const Trajectory& poses);

/// Whether a path is no straight line, by its scatter across.
bool bends(const Trajectory& path);

/// One goes many times as far as the other, as in other units; "" if they do not. Of poses that
/// both have.
std::string size_contradiction(const Trajectory& of_reference, const Trajectory& of_estimate);

/// Quaternions of one that stand as w x y z: the orientations agree once they are taken so. Worlds
/// that fit once one is tilted. Empty where nothing is to be explained, or nothing does.
/// `accuracy`: that of evaluate() with these options.
std::vector<std::string> world_hints(const Trajectory& reference, const Trajectory& estimate,
                                     const Options& options, const Accuracy& accuracy);
/// And sizes of which one is many times the other: another unit.
std::vector<std::string> hints(const Trajectory& reference, const Trajectory& estimate,
                               const Options& options, const Accuracy& accuracy);

}  // namespace viwo::eval
