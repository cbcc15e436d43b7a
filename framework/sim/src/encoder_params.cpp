#include "viwo/sim/encoder_params.hpp"

#include <string>

namespace viwo::sim {

EncoderSimulation encoder_simulation_from(const ParamSet& params, const ModelDescription& robot) {
  EncoderSimulation out;
  out.duration_s = params.number("duration_s");
  out.start_ns = params.integer("start_ns");
  out.noise = params.flag("noise");
  out.wander = params.number("intrinsics_wander");
  out.wander_time_s = params.number("intrinsics_wander_time_s");
  const auto starts = params.numbers("slip_start_s");
  out.slip.start_s.assign(starts.begin(), starts.end());
  out.slip.duration_s = params.number("slip_duration_s");
  out.slip.ratio = params.number("slip_ratio");
  const std::int64_t wheel = params.integer("slip_wheel");
  if (wheel > robot.n_drive) {
    throw ParamError("slip_wheel", std::to_string(wheel) + " is not one of the robot's " +
                                       std::to_string(robot.n_drive) + " wheels");
  }
  out.slip.wheel = static_cast<int>(wheel) - 1;
  out.outlier_probability = params.number("outlier_probability");
  out.outlier_rad_per_s = params.number("outlier_rad_per_s");
  out.drive_resolution_rad_per_s = params.number("drive_resolution_rad_per_s");
  return out;
}

}  // namespace viwo::sim
