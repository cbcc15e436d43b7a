// What simulated cameras look at: a closed room with boxes in it, all of it textured.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "viwo/rendering/texture.hpp"

namespace viwo::rendering {

/// What is on one face of a block: the texture, its scale, and which point of it is in the middle.
struct Face {
  std::shared_ptr<const Texture> texture;
  float texels_per_m = 250.F;
  float x = 0.F, y = 0.F;  ///< texels
};

/// A box that stands upright, turned by a yaw. Its faces are, in its own axes, -x, +x, -y, +y, -z,
/// +z; the texture of a face across axis a has its x along axis a + 1 and its y along a + 2.
struct Block {
  Eigen::Vector3f centre = Eigen::Vector3f::Zero();  ///< in G, m
  Eigen::Vector3f half = Eigen::Vector3f::Ones();    ///< half of its edges, m
  float cosine = 1.F, sine = 0.F;                    ///< of the yaw
  std::array<Face, 6> faces;
};

/// The surroundings. `room` is seen from inside, the blocks from outside.
struct TexturedRoom {
  Block room;
  std::vector<Block> blocks;
};

struct RoomOptions {
  std::uint64_t seed = 1;
  /// Edges and centre of the room in the plane; the floor is at floor_m.
  Eigen::Vector2d size_m{8., 8.};
  Eigen::Vector2d centre_m{0., 0.};
  double floor_m = -0.12;
  double height_m = 3.;
  int blocks = 40;           ///< boxes and panels
  double clearance_m = 0.5;  ///< between their surfaces and the path
  double reach_m = 3.;       ///< they are at most about that far from the path
  int texture_size = 1024;   ///< a power of two
};

/// A room, its textures and blocks drawn with options.seed. Blocks stand along the path (positions
/// in G of whoever moves through the room, at least one), clear of it and inside of the room; one
/// for which there is no place is left out. InputError when the path comes closer than kRoomMargin
/// to a wall, the floor or the ceiling; it says how large the room must be.
TexturedRoom make_room(const RoomOptions& options, std::span<const Eigen::Vector3d> path);

inline constexpr double kRoomMargin = 0.1;  ///< m

}  // namespace viwo::rendering
