// A first state from wheels and IMU while the base moves: the wheels give velocity and yaw rate,
// what they leave of the specific force is gravity, what they leave of the rate is the gyro's bias.
// Equations: docs/math/filter.md.
#pragma once

#include <memory>
#include <span>

#include "viwo/api/rig.hpp"
#include "viwo/estimator/start_search.hpp"
#include "viwo/start/start_options.hpp"
#include "viwo/wheel/wheel_model.hpp"

namespace viwo {

struct MovingStartOptions : StartOptions {
  /// What encoder noise and the prior of the calibration do not explain: slip, and the ground.
  double sigma_velocity_m_per_s = 0.02;          ///< of O, each axis, the normal of the ground too
  double sigma_yaw_rate_rad_per_s = 0.002;       ///< mean over the window
  double sigma_tilt_rate_rad_per_s = 0.02;       ///< the same about the other two axes of O
  std::shared_ptr<const WheelModel> model = {};  ///< of the wheel set
  WheelsPrior wheels = {};                       ///< its calibration
  Eigen::MatrixXd P_wheels = {};                 ///< how well [x_WI, theta_ItoO, p_IinO] are known
};

/// The state shortly (0.05 s) before the end of the measurements, from the last `window_s` before
/// it; also for a base at rest. The origin of G is there where the IMU is then, and the x axis of G
/// in the IMU's x-z plane (y-z, if x is nearly vertical). `encoders` are those of the wheel set.
///
/// Nothing: the measurements do not fill the window, have holes in it, or contradict what the
/// options say of biases, gravity and motion by more than four sigma.
StartAttempt start_from_motion(std::span<const ImuSample> imu,
                               std::span<const EncoderSample> encoders,
                               const MovingStartOptions& options);

}  // namespace viwo
