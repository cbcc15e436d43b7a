// Parameters of contact_simulator beside those of all simulators.
#pragma once

#include <array>

#include "encoders.hpp"
#include "viwo/api/params.hpp"
#include "viwo/log/sensor_params.hpp"
#include "viwo/sim/drive_params.hpp"
#include "viwo/sim/rig_simulator.hpp"
#include "viwo/sim/true_cameras.hpp"

namespace viwo::contact {

// clang-format off
inline constexpr std::array kParams{
    ParamSpec{.name = "base", .type = ParamType::kString,
              .choices = "swerve|differential|ackermann|mecanum|skid_steer",
              .help = "what is driven, steered and free (model.md)"},
    ParamSpec{.name = "x_m", .type = ParamType::kNumbers, .unit = "m",
              .help = "contacts of the wheels, or where their steering axes meet the ground, along x in O; ackermann: rear left, rear right, front left, front right"},
    ParamSpec{.name = "y_m", .type = ParamType::kNumbers, .unit = "m",
              .help = "the same along y"},
    ParamSpec{.name = "radius_m", .type = ParamType::kNumbers, .unit = "m", .min = 0.,
              .min_exclusive = true, .help = "rolling radii without load, one for all or one per wheel"},
    ParamSpec{.name = "steer_offset_rad", .type = ParamType::kNumbers, .unit = "rad",
              .fallback = "[0]", .help = "reading of a steering encoder when its wheel points along x, one for all or one per channel"},
    ParamSpec{.name = "roller_angle_rad", .type = ParamType::kNumbers, .unit = "rad",
              .fallback = "[0]", .min = -1.4, .max = 1.4,
              .help = "mecanum: axis of the rollers on the ground, from x, one per wheel"},
    ParamSpec{.name = "wheel_speeds", .type = ParamType::kString, .fallback = "rear",
              .choices = "rear|all", .help = "ackermann: which wheels have a drive encoder"},
    ParamSpec{.name = "steering", .type = ParamType::kString, .fallback = "centre",
              .choices = "centre|both", .help = "ackermann: encoder of a linkage, as of a wheel in the middle of the front axle, or one on each front wheel"},
    ParamSpec{.name = "castor_x_m", .type = ParamType::kNumbers, .unit = "m", .fallback = "[]",
              .help = "castors, which carry load and have no encoder"},
    ParamSpec{.name = "castor_y_m", .type = ParamType::kNumbers, .unit = "m", .fallback = "[]",
              .help = "the same along y"},
    ParamSpec{.name = "sigma_true_radius_m", .type = ParamType::kNumber, .unit = "m",
              .fallback = "0", .min = 0., .help = "the true radii differ by draws of this"},
    ParamSpec{.name = "sigma_true_position_m", .type = ParamType::kNumber, .unit = "m",
              .fallback = "0", .min = 0., .help = "the true places of swerve wheels differ by draws of this; not that of the first"},
    ParamSpec{.name = "sigma_true_steer_offset_rad", .type = ParamType::kNumber, .unit = "rad",
              .fallback = "0", .min = 0., .help = "the true steering offsets differ by draws of this; not that of the first swerve wheel"},
    ParamSpec{.name = "controller_knows", .type = ParamType::kString, .fallback = "truth",
              .choices = "truth|nominal", .help = "what the wheels are commanded with: the true base, or what stands here"},
    ParamSpec{.name = "ideal", .type = ParamType::kBool, .fallback = "false",
              .help = "no slip, play, lag, scrub, resolution and loss of radius"},
    ParamSpec{.name = "mass_kg", .type = ParamType::kNumber, .unit = "kg", .fallback = "30",
              .min = 0., .min_exclusive = true, .help = "of the base with all on it"},
    ParamSpec{.name = "com_m", .type = ParamType::kNumbers, .unit = "m", .fallback = "[0, 0, 0.15]",
              .help = "its centre of mass in O"},
    ParamSpec{.name = "inertia_kgm2", .type = ParamType::kNumbers, .unit = "kg m^2",
              .fallback = "[0.6, 0.6, 0.9]", .min = 0.,
              .help = "its moments of inertia about axes along those of O"},
    ParamSpec{.name = "slip_per_load", .type = ParamType::kNumber, .fallback = "0.05", .min = 0.,
              .max = 1., .help = "slip of a tyre that pulls its own load, by its stiffness alone; 0: nothing slips"},
    ParamSpec{.name = "slip_angle_per_load_rad", .type = ParamType::kNumber, .unit = "rad",
              .fallback = "0.1", .min = 0., .max = 1.,
              .help = "slip angle of a tyre that is pulled sideways by its own load; 0 if nothing slips"},
    ParamSpec{.name = "load_exponent", .type = ParamType::kNumber, .fallback = "0.9", .min = 0.5,
              .max = 1., .help = "stiffness of a tyre grows with this power of its load"},
    ParamSpec{.name = "friction", .type = ParamType::kNumber, .fallback = "0.8", .min = 0.,
              .min_exclusive = true, .help = "largest force of a tyre over its load"},
    ParamSpec{.name = "rolling_resistance", .type = ParamType::kNumber, .fallback = "0.01",
              .min = 0., .max = 0.5, .help = "of free wheels and castors, over their load"},
    ParamSpec{.name = "radius_loss_m_per_n", .type = ParamType::kNumber, .unit = "m/N",
              .fallback = "1e-6", .min = 0., .help = "rolling radius lost with load"},
    ParamSpec{.name = "scrub_m", .type = ParamType::kNumber, .unit = "m", .fallback = "0",
              .help = "swerve: contact to the left of the steering axis, seen along the wheel"},
    ParamSpec{.name = "steer_play_rad", .type = ParamType::kNumber, .unit = "rad",
              .fallback = "0.003", .min = 0., .max = 0.5,
              .help = "play between a steering encoder and its wheel, full width"},
    ParamSpec{.name = "steer_lag_s", .type = ParamType::kNumber, .unit = "s", .fallback = "0.02",
              .min = 0., .max = 10., .help = "time constant of the steering servos"},
    ParamSpec{.name = "drive_play_rad", .type = ParamType::kNumber, .unit = "rad",
              .fallback = "0.002", .min = 0., .max = 0.5,
              .help = "play between a drive encoder and its wheel, full width"},
    ParamSpec{.name = "drive_resolution_rad", .type = ParamType::kNumber, .unit = "rad",
              .fallback = "2.5e-5", .min = 0., .help = "of a wheel's angle, whose differences are the drive rates"},
    ParamSpec{.name = "steer_resolution_rad", .type = ParamType::kNumber, .unit = "rad",
              .fallback = "4e-4", .min = 0., .help = "of the steering angles"},
    ParamSpec{.name = "sigma_drive_rad_per_s", .type = ParamType::kNumber, .unit = "rad/s",
              .fallback = "0.001", .min = 0., .help = "white noise of a drive rate, per sample"},
    ParamSpec{.name = "sigma_steer_rad", .type = ParamType::kNumber, .unit = "rad",
              .fallback = "0.001", .min = 0., .help = "white noise of a steering angle, per sample"},
    ParamSpec{.name = "wheel_rate_hz", .type = ParamType::kNumber, .unit = "Hz", .fallback = "100",
              .min = 1., .max = 10000., .help = "rate of the encoder samples"},
    ParamSpec{.name = "t_OtoI_s", .type = ParamType::kNumber, .unit = "s", .fallback = "0",
              .min = -10., .max = 10., .help = "t_imu = t_odom + t_OtoI"},
};
// clang-format on

inline Eigen::Vector3d three(const ParamSet& params, const char* key) {
  const auto values = params.numbers(key);
  if (values.size() != 3) throw ParamError(key, "needs three numbers");
  return {values[0], values[1], values[2]};
}

inline TrueBaseErrors true_base_errors_from(const ParamSet& params) {
  return {params.number("sigma_true_radius_m"), params.number("sigma_true_position_m"),
          params.number("sigma_true_steer_offset_rad")};
}

/// `ideal`: rigid wheels that do as they are told.
inline Physics physics_from(const ParamSet& params, bool ideal) {
  Physics out;
  out.gravity_m_per_s2 = params.number("gravity_m_per_s2");
  out.mass_kg = params.number("mass_kg");
  out.com_m = three(params, "com_m");
  out.inertia_kgm2 = three(params, "inertia_kgm2");
  if (ideal) return out;
  out.slip_per_load = params.number("slip_per_load");
  out.slip_angle_per_load_rad = params.number("slip_angle_per_load_rad");
  if ((out.slip_per_load > 0.) != (out.slip_angle_per_load_rad > 0.)) {
    throw ParamError("slip_angle_per_load_rad",
                     "tyres that slip slip in both directions, those "
                     "that do not (slip_per_load: 0) in none");
  }
  out.load_exponent = params.number("load_exponent");
  out.friction = params.number("friction");
  out.rolling_resistance = params.number("rolling_resistance");
  out.radius_loss_m_per_n = params.number("radius_loss_m_per_n");
  out.steer_play_rad = params.number("steer_play_rad");
  out.steer_lag_s = params.number("steer_lag_s");
  return out;
}

/// `ideal`: without resolution and play.
inline EncoderErrors encoder_errors_from(const ParamSet& params, bool ideal, bool noise) {
  EncoderErrors out;
  if (!ideal) {
    out.drive_resolution_rad = params.number("drive_resolution_rad");
    out.steer_resolution_rad = params.number("steer_resolution_rad");
    out.drive_play_rad = params.number("drive_play_rad");
  }
  if (noise) {
    out.sigma_drive_rad_per_s = params.number("sigma_drive_rad_per_s");
    out.sigma_steer_rad = params.number("sigma_steer_rad");
  }
  return out;
}

}  // namespace viwo::contact
