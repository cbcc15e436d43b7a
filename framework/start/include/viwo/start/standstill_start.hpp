// A first state from a rest: gravity gives roll and pitch, the gyro its bias.
#pragma once

#include <span>
#include <vector>

#include "viwo/api/measurement.hpp"
#include "viwo/estimator/start_search.hpp"
#include "viwo/start/start_options.hpp"

namespace viwo {

struct StandstillOptions : StartOptions {
  std::vector<double> t_CtoI_s = {};  ///< by camera, of the middle row: t_imu = t_camera + t_CtoI
  std::vector<double> t_OtoI_s = {};  ///< by wheel set, likewise
};

/// The state at the end of the last `window_s` of the IMU (5 % less will do) if the base stood
/// still in it (F-9): no wheel turned, no image moved, the mean specific force is gravity within
/// the bias prior, the mean rate within the bias prior, and both halves of the window agree.
/// Vibration may scatter the readings if wheels or images have seen the rest; then the covariance
/// is that of the means as they are (F-33). Where neither has, the readings scatter as their noise
/// does. `encoders`: those of each wheel set. `tracks`: of one sensor, its points keep their ids.
/// The origin of G is there where the IMU is then, and the x axis of G in the IMU's x-z plane (y-z,
/// if x is nearly vertical).
StartAttempt start_from_standstill(std::span<const ImuSample> imu,
                                   std::span<const std::span<const EncoderSample>> encoders,
                                   const StandstillOptions& options,
                                   std::span<const FeatureSample> tracks = {});

}  // namespace viwo
