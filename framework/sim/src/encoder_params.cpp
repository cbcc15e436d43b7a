#include "viwo/sim/encoder_params.hpp"

#include <string>

namespace viwo::sim {

EncoderSimulation encoder_simulation_from(const EncoderParams& params,
                                          const ModelDescription& robot, double duration_s,
                                          std::int64_t start_ns, bool noise) {
  EncoderSimulation out;
  out.duration_s = duration_s;
  out.start_ns = start_ns;
  out.noise = noise;
  if (params.intrinsics_wander > 0.) {
    out.sigma_wander = wander_sigmas(robot, params.intrinsics_wander, params.intrinsics_wander_of);
  }
  out.wander_time_s = params.intrinsics_wander_time_s;
  out.slip.start_s = params.slip_start_s;
  out.slip.duration_s = params.slip_duration_s;
  out.slip.ratio = params.slip_ratio;
  const int wheel = params.slip_wheel;
  if (wheel > robot.n_drive) {
    throw ParamError("slip_wheel", std::to_string(wheel) + " is not one of the robot's " +
                                       std::to_string(robot.n_drive) + " wheels");
  }
  out.slip.wheel = wheel - 1;
  out.outlier_probability = params.outlier_probability;
  out.outlier_rad_per_s = params.outlier_rad_per_s;
  out.drive_resolution_rad_per_s = params.drive_resolution_rad_per_s;
  return out;
}

}  // namespace viwo::sim
