// How a simulated base drives on which ground: parameters that simulating sensors have in common.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "viwo/api/params.hpp"
#include "viwo/math/mix.hpp"
#include "viwo/sim/body_trajectory.hpp"

namespace viwo::sim {

/// Names of PlanarMotion, and a motion from a file.
inline constexpr const char* kMotionChoices =
    "icr_sweep|straight|lateral|circle|stationary|figure_eight|crab_varying|"
    "spin|constant_steering|pivot|sweep_then_straight|mixed|file";
inline constexpr const char* kMotionFileHelp =
    "of motion: file, a table with the columns time_s, v_x_m_per_s, v_y_m_per_s, omega_rad_per_s "
    "(plan.csv of viwo plan); the base stands before and after it";

/// How PlanarMotion goes.
struct MotionParams {
  std::string motion = "icr_sweep";
  std::filesystem::path motion_file;
  double duration_s = 60.;
  double speed_m_per_s = 0.5;
  double yaw_rate_rad_per_s = 0.6;
  Eigen::Vector2d pivot_m{0., 0.};
  double ramp_s = 1.;
  int repetition = 0;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(motion), {.choices = kMotionChoices, .help = "how the base moves"});
    b(VIWO_PARAM(motion_file), {.help = kMotionFileHelp});
    b(VIWO_PARAM(duration_s), {.unit = "s", .above = 0., .max = 7200., .help = "how long"});
    b(VIWO_PARAM(speed_m_per_s),
      {.unit = "m/s", .min = -20., .max = 20., .help = "speed of the motion"});
    b(VIWO_PARAM(yaw_rate_rad_per_s),
      {.unit = "rad/s",
       .min = -6.,
       .max = 6.,
       .help = "constant or peak yaw rate of the motions that turn"});
    b(VIWO_PARAM(pivot_m),
      {.unit = "m", .help = "point of the base that motion pivot turns about"});
    b(VIWO_PARAM(ramp_s), {.unit = "s",
                           .min = 0.,
                           .max = 3600.,
                           .help = "smooth start from rest; 0: at speed from the beginning"});
    b(VIWO_PARAM(repetition),
      {.min = 0.,
       .max = 1e9,
       .help =
           "of several drives of one robot, with one seed, which one: what is true of the robot "
           "is the same in all, noise and slip are others in each"});
  }

  /// What noise is drawn with, where what is true of the robot is drawn with `seed`.
  std::uint64_t noise_seed(std::uint64_t seed) const {
    return repetition == 0 ? seed : mix64(seed + (static_cast<std::uint64_t>(repetition) << 32U));
  }
};

/// How PlanarMotion and Ground go.
struct DriveParams : MotionParams {
  std::string ground = "flat";
  double ground_amplitude_m = 0.05;
  double ground_wavelength_m = 3.;
  std::int64_t start_ns = 0;

  void bind(ParamBinder& b) {
    MotionParams::bind(b);
    b(VIWO_PARAM(ground), {.choices = "flat|uneven", .help = "what the base drives on"});
    b(VIWO_PARAM(ground_amplitude_m),
      {.unit = "m", .min = 0., .max = 10., .help = "of the waves of uneven ground"});
    b(VIWO_PARAM(ground_wavelength_m),
      {.unit = "m", .min = 0.1, .max = 1000., .help = "of the waves of uneven ground"});
    b(VIWO_PARAM(start_ns),
      {.unit = "ns", .min = 0., .max = 4e18, .help = "stamp at which the motion starts"});
  }
};

/// One of the motions by name, or that of a file. ParamError for a file that is missing, wrong or
/// not asked for.
PlanarMotion motion_from(const std::string& name, const std::filesystem::path& file,
                         const MotionOptions& options);

/// The trajectory of DriveParams from before time 0 to behind `end_s`, with `margin_s` more at
/// both ends, and half a second in which the ends of its spline do not matter; `sideways` as for
/// BodyTrajectory::drive(). ParamError for what cannot be driven.
BodyTrajectory drive_from(const DriveParams& params, double end_s, double margin_s,
                          const SidewaysVelocity& sideways = {});

}  // namespace viwo::sim
