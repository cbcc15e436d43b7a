// Parameters of the car-like base.
#pragma once

#include <string>
#include <vector>

#include "viwo/api/params.hpp"

namespace viwo::ackermann {

struct Params {
  double wheel_base_m = 0.;
  double track_m = 0.;
  std::vector<double> radius_m;
  std::string wheel_speeds = "rear";
  std::string steering = "centre";
  std::vector<double> steer_offset_rad{0.};
  double max_steer_rad = 1.;
  double prior_sigma_radius_m = 0.0003;
  double prior_sigma_length_m = 0.005;
  double prior_sigma_steer_offset_rad = 0.01;
  double sigma_drive_rad_per_s = 0.001;
  double sigma_steer_rad = 0.001;
  double sigma_lateral_m_per_s = 0.001;
  double sigma_front_lateral_m_per_s = 0.001;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(wheel_base_m), {.unit = "m",
                                 .above = 0.,
                                 .max = 50.,
                                 .required = true,
                                 .help = "distance between the axles"});
    b(VIWO_PARAM(track_m),
      {.unit = "m",
       .above = 0.,
       .max = 50.,
       .required = true,
       .help = "distance between the left and right contact lines, of both axles"});
    b(VIWO_PARAM(radius_m), {.unit = "m",
                             .above = 0.,
                             .max = 10.,
                             .required = true,
                             .help = "wheel radii, one for all or one per measured wheel"});
    b(VIWO_PARAM(wheel_speeds),
      {.choices = "rear|all",
       .help = "drive channels: rear left, rear right; all: then front left, front right"});
    b(VIWO_PARAM(steering),
      {.choices = "centre|both",
       .help = "steering channels: one, of a wheel in the middle of the front axle, or front "
               "left and front right"});
    b(VIWO_PARAM(steer_offset_rad),
      {.unit = "rad",
       .help = "reading when the base drives straight on, one for all or one per channel"});
    b(VIWO_PARAM(max_steer_rad),
      {.unit = "rad",
       .above = 0.,
       .max = 1.5,
       .help =
           "how far the middle of the front axle steers in simulation; the estimate has no limit"});
    b(VIWO_PARAM(prior_sigma_radius_m),
      {.unit = "m", .above = 0., .help = "how well the radii are known"});
    b(VIWO_PARAM(prior_sigma_length_m),
      {.unit = "m", .above = 0., .help = "how well wheel base and track are known"});
    b(VIWO_PARAM(prior_sigma_steer_offset_rad),
      {.unit = "rad", .above = 0., .help = "how well the steering offsets are known"});
    b(VIWO_PARAM(sigma_drive_rad_per_s),
      {.unit = "rad/s", .above = 0., .help = "noise of a drive rate, per sample"});
    b(VIWO_PARAM(sigma_steer_rad),
      {.unit = "rad", .above = 0., .help = "noise of a steering angle, per sample"});
    b(VIWO_PARAM(sigma_lateral_m_per_s),
      {.unit = "m/s", .above = 0., .help = "sideways velocity of the rear axle, per sample"});
    b(VIWO_PARAM(sigma_front_lateral_m_per_s),
      {.unit = "m/s",
       .above = 0.,
       .help = "velocity of the front axle across its wheels, per sample"});
  }
};

}  // namespace viwo::ackermann
