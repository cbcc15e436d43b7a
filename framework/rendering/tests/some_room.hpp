// A room that tests look at, and who drives through it.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "viwo/rendering/textured_room.hpp"
#include "viwo/sim/body_trajectory.hpp"

namespace viwo::rendering {

inline std::vector<Eigen::Vector3d> some_path() {
  const auto trajectory =
      sim::BodyTrajectory::drive(sim::PlanarMotion("icr_sweep"), sim::Ground(), -0.5, 8.5);
  std::vector<Eigen::Vector3d> path;
  for (double t = 0.; t < 8.; t += 0.1) {
    path.push_back(trajectory.body(t).p_BinG + Eigen::Vector3d(0., 0., 0.2));
  }
  return path;
}

inline RoomOptions some_options() {
  RoomOptions options;
  options.centre_m = {1.8, 0.6};
  options.texture_size = 512;
  return options;
}

}  // namespace viwo::rendering
