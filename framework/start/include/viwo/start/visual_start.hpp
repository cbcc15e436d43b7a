// A first state from cameras and IMU while the robot moves, without wheels: images tell where it
// went up to a scale, the accelerometer tells the scale and where down is; two cameras know the
// scale by themselves. Equations: docs/math/filter.md.
#pragma once

#include <span>
#include <vector>

#include "viwo/api/measurement.hpp"
#include "viwo/api/rig.hpp"
#include "viwo/estimator/start_search.hpp"
#include "viwo/filter/state_blocks.hpp"
#include "viwo/start/start_options.hpp"

namespace viwo {

struct VisualStartOptions : StartOptions {
  std::vector<CameraPrior> cameras = {};  ///< by FeatureSample::camera
  PriorCorrelations correlations = {};    ///< of what the cameras' blocks have, by names
};

/// The state at the last image, from the images of the last `window_s` before it, or of twice that
/// where this is too short to tell the scale. `tracks`: of one sensor, its points keep their ids;
/// those of one landmark in several cameras have the same. The origin of G is there where the IMU
/// is then, and the x axis of G in the IMU's x-z plane (y-z, if x is nearly vertical).
///
/// Nothing: the measurements do not fill the window, contradict each other or what the options say
/// of biases by more than four sigma, or leave velocity or tilt too uncertain to begin with.
StartAttempt start_from_images(std::span<const ImuSample> imu,
                               std::span<const FeatureSample> tracks,
                               const VisualStartOptions& options);

}  // namespace viwo
