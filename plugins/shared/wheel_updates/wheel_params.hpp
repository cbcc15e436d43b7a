// Parameters that the wheel updates have in common.
#pragma once

#include "viwo/api/params.hpp"

namespace viwo {

struct WheelUpdateParams {
  double gate_probability = 0.001;
  double sample_gate_probability = 0.;
  bool second_order_noise = true;
  double motion_sigmas = 5.;
  double wheel_check_probability = 1e-6;
  bool find_noise = true;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(gate_probability),
      {.min = 0.,
       .max = 0.5,
       .help = "intervals less likely than this are weighed down (F-32) and counted; 0: none"});
    b(VIWO_PARAM(sample_gate_probability),
      {.min = 0.,
       .max = 0.5,
       .help = "samples whose wheels contradict each other more than this are bridged; only for "
               "calibrated wheels; 0: none"});
    b(VIWO_PARAM(second_order_noise),
      {.help = "adds what the linearisation leaves out, as far as the prior is uncertain"});
    b(VIWO_PARAM(motion_sigmas),
      {.min = 0.,
       .max = 100.,
       .help = "what the wheels show of a motion within so many of its own sigmas teaches nothing "
               "about the calibration; 0: all that is measured is motion, noise too"});
    b(VIWO_PARAM(wheel_check_probability),
      {.min = 0.,
       .max = 0.5,
       .help = "of a sample whose wheels contradict each other more than this, the one that all "
               "others contradict is left out; 0: never"});
    b(VIWO_PARAM(find_noise), {.help = "the noise is scaled to what the residuals tell, and "
                                       "reported; false: as configured"});
  }

  /// For data without noise, linearised once: nothing is found out or left out.
  void make_exact() {
    second_order_noise = find_noise = false;
    motion_sigmas = wheel_check_probability = 0.;
  }
};

}  // namespace viwo
