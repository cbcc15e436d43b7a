// Images of a textured room through a camera, ray by ray.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/filter_view.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/rendering/textured_room.hpp"

namespace viwo::rendering {

/// Where a camera is, and how it moves: that is for the rows of a rolling shutter.
struct CameraPose {
  Eigen::Matrix3d R_CtoG = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_CinG = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_CinG = Eigen::Vector3d::Zero();  ///< m/s
  Eigen::Vector3d w_CinC = Eigen::Vector3d::Zero();  ///< rad/s

  CameraPose after(double dt_s) const;
};

/// What a sensor makes of the light.
struct Exposure {
  double gain = 1.;         ///< of what is seen, before noise
  double noise_sigma = 0.;  ///< white, grey levels
  std::uint64_t seed = 0;   ///< of the noise; equal seeds give equal noise
};

/// The room through one camera. Immutable, so calls may be concurrent.
class ImageRenderer {
 public:
  /// `vignette`: by what share the corners are darker than the middle.
  ImageRenderer(const CameraView& camera, std::shared_ptr<const TexturedRoom> room,
                double vignette = 0.);

  /// Every pixel is what its ray meets first, smoothed as Texture does it for the pixel's size;
  /// pixels that no direction projects to are black. The camera must be inside the room and outside
  /// of all blocks. Memory of `out` is used again. `pose`: of the middle row (IMG-11).
  void render(const CameraPose& pose, const Exposure& exposure, Image& out) const;

 private:
  struct Ray {
    float x = 0.F, y = 0.F, z = 0.F;  ///< unit vector in C
    float angle = 0.F;                ///< that the pixel covers, rad; 0: no direction
    float gain = 1.F;
  };
  /// Pixels that are looked at together, in a cone.
  struct Tile {
    int x = 0, y = 0, height = 0;  ///< first pixel, rows
    Eigen::Vector3f axis = Eigen::Vector3f::UnitZ();
    float half_angle = 0.F;  ///< rad
  };
  class Painter;

  void make_rays(double vignette);
  void make_tiles();
  /// Calls `act` for each tile, with the painter at the pose of its rows.
  template <class Act>
  void each_tile(const CameraPose& pose, Painter& painter, const Act& act) const;

  CameraView camera_;
  std::shared_ptr<const TexturedRoom> room_;
  std::vector<Ray> rays_;
  std::vector<Tile> tiles_;
};

}  // namespace viwo::rendering
