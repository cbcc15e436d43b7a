// Tracks of landmarks in the images of a camera rig on a trajectory.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/filter_view.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/sim/body_trajectory.hpp"

namespace viwo::sim {

struct FeatureSimulation {
  double duration_s = 60.;
  double rate_hz = 10.;
  double phase_s = 0.;        ///< of the first images
  std::int64_t start_ns = 0;  ///< stamp of time 0 of the trajectory
  int features = 200;         ///< most points of one image; that many wherever landmarks can be put
  double landmark_min_m = 5.;  ///< distance from the camera at which a landmark is put ...
  double landmark_max_m = 7.;  ///< ... is between these; it is seen from half to 1.5 times of them
  double max_view_angle_rad = 1.4;  ///< nothing is seen further off the optical axis
  double sigma_px = 1.;
  bool noise = true;                ///< of pixels
  double outlier_probability = 0.;  ///< per point: it is somewhere within +-outlier_px of the truth
  double outlier_px = 30.;
  double dropout_probability = 0.;  ///< per point: this image does not have it
};

struct SimulatedFeatures {
  /// In the order in which they are taken, at each time in the order of the cameras; stamps are in
  /// the clocks of the cameras.
  std::vector<FeatureSample> samples;
  /// Place of the landmark with that id. One landmark has several ids when it was lost and seen
  /// again.
  std::vector<Eigen::Vector3d> p_FinG;
};

/// Times of the images, IMU clock without start_ns: phase + k / rate up to the duration.
std::vector<std::int64_t> image_times_ns(const FeatureSimulation& options);

/// Images of all cameras at the same times. A landmark keeps its id, the same in all cameras, as
/// long as one camera sees it without a break; dropouts are not breaks. Where an image has less
/// than `features` points, landmarks seen before come first, then new ones are put on the ray of a
/// random pixel. Pixel noise can put a point out of the image.
SimulatedFeatures simulate_features(const BodyTrajectory& trajectory, const Mounting& mounting,
                                    std::span<const CameraView> cameras,
                                    const FeatureSimulation& options, std::uint64_t seed);

}  // namespace viwo::sim
