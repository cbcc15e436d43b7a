// What a picture of a run shows at one instant, and drawing it: the images of the cameras with
// their tracks, the trajectory from above, and curves over time.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/measurement.hpp"
#include "viwo/view/picture.hpp"
#include "viwo/view/tracks.hpp"

namespace viwo::view {

/// One camera. Points that are outside of its image, or not finite, are not drawn.
struct CameraImage {
  std::string name;
  int width_px = 0;  ///< of its images
  int height_px = 0;
  /// nullptr, or not width x height: the points are drawn on a dark field.
  const Image* pixels = nullptr;
  std::string note;  ///< why there are no pixels, if that is worth saying
  std::vector<Track> tracks;
};

/// A way on the ground.
struct Path {
  std::string name;
  bool reference = false;  ///< drawn in grey, below the others
  std::vector<Eigen::Vector2d> points_m;
};

/// Where the body is, and where it looks.
struct Body {
  Eigen::Vector2d p_m = Eigen::Vector2d::Zero();
  double yaw_rad = 0.;
};

/// y over x with a band. All vectors are of one size; what is not finite is left out.
struct Curve {
  std::string title;
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> low, high;  ///< of the band
};

struct Scene {
  std::string status;  ///< one line of text, ASCII
  std::vector<CameraImage> cameras;
  std::vector<Path> paths;
  std::optional<Body> body;
  std::vector<Curve> curves;
};

struct PictureSize {
  int width_px = 1280;
  int height_px = 720;
};

/// Points are coloured by how long they have been tracked; a ring marks those that two cameras see
/// (one id in both). std::invalid_argument for a size below 320 x 240 and for curves whose vectors
/// do not fit. Equal scenes give equal pictures.
Picture draw(const Scene& scene, PictureSize size = {});

}  // namespace viwo::view
