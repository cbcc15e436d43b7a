// How far wheels say that the base went, and whereto, by what poses say.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "viwo/series/recording.hpp"

namespace viwo::series {

/// Displacements over windows in which the base goes straight: of the wheels by their speed, of the
/// poses by their positions.
struct Speeds {
  std::vector<double> ratio;  ///< of the wheels to the poses
  /// Cosine and sine of the direction of the wheels from that of the poses, in the plane, body
  /// frames as they are, times the way of the poses: errors of these are most of a short one.
  std::vector<Eigen::Vector2d> direction;
  double path_m = 0.;

  Eigen::Vector2d mean_direction() const;
};

/// How long a window is at least, and how far the poses go in it.
struct WindowSize {
  double length_s = 1., way_m = 0.03;
};

Speeds speeds_of(const Wheels& wheels, const Poses& poses, const WindowSize& size = {});

}  // namespace viwo::series
