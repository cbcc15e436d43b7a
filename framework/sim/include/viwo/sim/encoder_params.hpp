// What encoders of a simulated base read beside its motion: parameters that simulating sensors have
// in common.
#pragma once

#include <cstdint>
#include <vector>

#include "viwo/api/params.hpp"
#include "viwo/sim/encoder_simulator.hpp"

namespace viwo::sim {

/// What encoders read beside the motion.
struct EncoderParams {
  double true_intrinsics_scale = 0.;
  double intrinsics_wander = 0.;
  double intrinsics_wander_time_s = 2.;
  std::vector<std::string> intrinsics_wander_of;
  std::vector<double> slip_start_s;
  double slip_duration_s = 0.5;
  int slip_wheel = 1;
  double slip_ratio = 0.3;
  double outlier_probability = 0.;
  double outlier_rad_per_s = 5.;
  double drive_resolution_rad_per_s = 0.;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(true_intrinsics_scale),
      {.min = 0.,
       .help = "0: the nominal intrinsics are true; s: nominal + s * prior sigma * gaussian"});
    b(VIWO_PARAM(intrinsics_wander),
      {.min = 0.,
       .help = "each intrinsic wanders about its true value with a sigma of so many prior "
               "sigmas (Gauss-Markov)"});
    b(VIWO_PARAM(intrinsics_wander_time_s),
      {.unit = "s", .above = 0., .help = "its time constant"});
    b(VIWO_PARAM(intrinsics_wander_of),
      {.help = "what the names of those that wander begin with: [r, delta_o]; none: all wander"});
    b(VIWO_PARAM(slip_start_s),
      {.unit = "s", .help = "when a wheel starts to spin, reading more than it rolls"});
    b(VIWO_PARAM(slip_duration_s), {.unit = "s", .min = 0., .help = "for how long each time"});
    b(VIWO_PARAM(slip_wheel), {.min = 1., .help = "drive channel that slips, from 1"});
    b(VIWO_PARAM(slip_ratio), {.help = "0.3: the drive reads 30 % more than the wheel rolls"});
    b(VIWO_PARAM(outlier_probability),
      {.min = 0.,
       .max = 1.,
       .help = "probability per encoder sample that one drive channel is off"});
    b(VIWO_PARAM(outlier_rad_per_s),
      {.unit = "rad/s", .min = 0., .help = "by how much, with either sign"});
    b(VIWO_PARAM(drive_resolution_rad_per_s),
      {.unit = "rad/s",
       .min = 0.,
       .help = "drive rates are rounded to its multiples; 0: not rounded"});
  }
};

/// As configured; rate and time offset are the sensor's own. ParamError for a wheel that `robot`
/// does not have.
EncoderSimulation encoder_simulation_from(const EncoderParams& params,
                                          const ModelDescription& robot, double duration_s,
                                          std::int64_t start_ns, bool noise);

}  // namespace viwo::sim
