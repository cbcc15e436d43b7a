// What explains trajectories that differ by far more than an odometry does.
#pragma once

#include <string>
#include <vector>

#include "viwo/eval/accuracy.hpp"

namespace viwo::eval {

/// Root mean square distance of a trajectory from its middle.
double extent_m(const Trajectory& poses);

/// One goes many times as far as the other, as in other units; "" if they do not. Of poses that
/// both have.
std::string size_contradiction(const Trajectory& of_reference, const Trajectory& of_estimate);

/// Quaternions of one file that stand in it as w x y z: the orientations agree once they are taken
/// so. Sizes of which one is many times the other: another unit. Empty where nothing is
/// to be explained, or nothing does. `accuracy`: that of evaluate() with these options.
std::vector<std::string> hints(const Trajectory& reference, const Trajectory& estimate,
                               const Options& options, const Accuracy& accuracy);

}  // namespace viwo::eval
