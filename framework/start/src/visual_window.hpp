// The images that a start from cameras and IMU works with.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "viwo/start/visual_start.hpp"

namespace viwo {

/// A point in one image.
struct StartSight {
  std::size_t key = 0;  ///< which of the images
  std::size_t camera = 0;
  Eigen::Vector2d uv_px = Eigen::Vector2d::Zero();
  Eigen::Vector3d bearing = Eigen::Vector3d::Zero();  ///< unit vector in C, at the key
  double after_s = 0.;                                ///< the key its row was exposed
};

/// A landmark: sights in the order of their images.
struct StartTrack {
  std::int64_t id = 0;
  std::vector<StartSight> sights;
};

/// An instant with images.
struct StartKey {
  std::int64_t t_ns = 0;       ///< IMU clock
  std::vector<ImuSample> imu;  ///< from the key before to this one, interpolated at both ends
};

struct VisualWindow {
  std::vector<StartKey> keys;
  std::vector<StartTrack> tracks;
};

/// The last images that lie within the IMU's readings and `window_s`, evenly spaced, and the points
/// that most of them share. What is in the way, or nothing.
std::string_view find_visual_window(std::span<const ImuSample> imu,
                                    std::span<const FeatureSample> tracks, double window_s,
                                    const VisualStartOptions& options, VisualWindow& window);

}  // namespace viwo
