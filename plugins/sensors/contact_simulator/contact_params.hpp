// Parameters of contact_simulator beside those of all simulators.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "encoders.hpp"
#include "viwo/api/params.hpp"
#include "viwo/log/joints.hpp"
#include "viwo/sim/drive_params.hpp"
#include "viwo/sim/rig_simulator.hpp"
#include "viwo/sim/true_mount.hpp"

namespace viwo::contact {

struct Params : log::JointParams, sim::DriveParams, sim::RigParams, sim::TrueMountParams {
  std::string base;
  std::vector<double> x_m;
  std::vector<double> y_m;
  std::vector<double> radius_m;
  std::vector<double> steer_offset_rad{0.};
  std::vector<double> roller_angle_rad{0.};
  std::string wheel_speeds = "rear";
  std::string steering = "centre";
  std::vector<double> castor_x_m;
  std::vector<double> castor_y_m;
  double sigma_true_radius_m = 0.;
  double sigma_true_position_m = 0.;
  double sigma_true_steer_offset_rad = 0.;
  std::string controller_knows = "truth";
  bool ideal = false;
  double mass_kg = 30.;
  Eigen::Vector3d com_m{0., 0., 0.15};
  Eigen::Vector3d inertia_kgm2{0.6, 0.6, 0.9};
  double slip_per_load = 0.05;
  double slip_angle_per_load_rad = 0.1;
  double load_exponent = 0.9;
  double friction = 0.8;
  double rolling_resistance = 0.01;
  double radius_loss_m_per_n = 1e-6;
  double scrub_m = 0.;
  double steer_play_rad = 0.003;
  double steer_lag_s = 0.02;
  double drive_play_rad = 0.002;
  double drive_resolution_rad = 2.5e-5;
  double steer_resolution_rad = 4e-4;
  double sigma_drive_rad_per_s = 0.001;
  double sigma_steer_rad = 0.001;
  double wheel_rate_hz = 100.;
  double t_OtoI_s = 0.;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(base), {.choices = "swerve|differential|ackermann|mecanum|skid_steer",
                         .required = true,
                         .help = "what is driven, steered and free (model.md)"});
    b(VIWO_PARAM(x_m),
      {.unit = "m",
       .required = true,
       .help = "contacts of the wheels, or where their steering axes meet the ground, along x in "
               "O; ackermann: rear left, rear right, front left, front right"});
    b(VIWO_PARAM(y_m), {.unit = "m", .required = true, .help = "the same along y"});
    b(VIWO_PARAM(radius_m), {.unit = "m",
                             .above = 0.,
                             .required = true,
                             .help = "rolling radii without load, one for all or one per wheel"});
    b(VIWO_PARAM(steer_offset_rad), {.unit = "rad",
                                     .help = "reading of a steering encoder when its wheel points "
                                             "along x, one for all or one per channel"});
    b(VIWO_PARAM(roller_angle_rad),
      {.unit = "rad",
       .min = -1.4,
       .max = 1.4,
       .help = "mecanum: axis of the rollers on the ground, from x, one per wheel"});
    b(VIWO_PARAM(wheel_speeds),
      {.choices = "rear|all", .help = "ackermann: which wheels have a drive encoder"});
    b(VIWO_PARAM(steering), {.choices = "centre|both",
                             .help = "ackermann: encoder of a linkage, as of a wheel in the middle "
                                     "of the front axle, or one on each front wheel"});
    b(VIWO_PARAM(castor_x_m),
      {.unit = "m", .help = "castors, which carry load and have no encoder"});
    b(VIWO_PARAM(castor_y_m), {.unit = "m", .help = "the same along y"});
    b(VIWO_PARAM(sigma_true_radius_m),
      {.unit = "m", .min = 0., .help = "the true radii differ by draws of this"});
    b(VIWO_PARAM(sigma_true_position_m),
      {.unit = "m", .min = 0., .help = "the true places of swerve wheels differ by draws of this"});
    b(VIWO_PARAM(sigma_true_steer_offset_rad),
      {.unit = "rad", .min = 0., .help = "the true steering offsets differ by draws of this"});
    sim::TrueMountParams::bind(b);
    b(VIWO_PARAM(controller_knows),
      {.choices = "truth|nominal",
       .help = "what the wheels are commanded with: the true base, or what stands here"});
    b(VIWO_PARAM(ideal), {.help = "no slip, play, lag, scrub, resolution and loss of radius"});
    b(VIWO_PARAM(mass_kg), {.unit = "kg", .above = 0., .help = "of the base with all on it"});
    b(VIWO_PARAM(com_m), {.unit = "m", .help = "its centre of mass in O"});
    b(VIWO_PARAM(inertia_kgm2),
      {.unit = "kg m^2", .min = 0., .help = "its moments of inertia about axes along those of O"});
    b(VIWO_PARAM(slip_per_load),
      {.min = 0.,
       .max = 1.,
       .help = "slip of a tyre that pulls its own load, by its stiffness alone; 0: nothing slips"});
    b(VIWO_PARAM(slip_angle_per_load_rad),
      {.unit = "rad",
       .min = 0.,
       .max = 1.,
       .help = "slip angle of a tyre that is pulled sideways by its own load; 0 if nothing slips"});
    b(VIWO_PARAM(load_exponent),
      {.min = 0.5, .max = 1., .help = "stiffness of a tyre grows with this power of its load"});
    b(VIWO_PARAM(friction), {.above = 0., .help = "largest force of a tyre over its load"});
    b(VIWO_PARAM(rolling_resistance),
      {.min = 0., .max = 0.5, .help = "of free wheels and castors, over their load"});
    b(VIWO_PARAM(radius_loss_m_per_n),
      {.unit = "m/N", .min = 0., .help = "rolling radius lost with load"});
    b(VIWO_PARAM(scrub_m),
      {.unit = "m",
       .help = "swerve: contact to the left of the steering axis, seen along the wheel"});
    b(VIWO_PARAM(steer_play_rad),
      {.unit = "rad",
       .min = 0.,
       .max = 0.5,
       .help = "play between a steering encoder and its wheel, full width"});
    b(VIWO_PARAM(steer_lag_s),
      {.unit = "s", .min = 0., .max = 10., .help = "time constant of the steering servos"});
    b(VIWO_PARAM(drive_play_rad),
      {.unit = "rad",
       .min = 0.,
       .max = 0.5,
       .help = "play between a drive encoder and its wheel, full width"});
    b(VIWO_PARAM(drive_resolution_rad),
      {.unit = "rad",
       .min = 0.,
       .help = "of a wheel's angle, whose differences are the drive rates"});
    b(VIWO_PARAM(steer_resolution_rad),
      {.unit = "rad", .min = 0., .help = "of the steering angles"});
    b(VIWO_PARAM(sigma_drive_rad_per_s),
      {.unit = "rad/s", .min = 0., .help = "white noise of a drive rate, per sample"});
    b(VIWO_PARAM(sigma_steer_rad),
      {.unit = "rad", .min = 0., .help = "white noise of a steering angle, per sample"});
    b(VIWO_PARAM(wheel_rate_hz),
      {.unit = "Hz", .min = 1., .max = 10000., .help = "rate of the encoder samples"});
    b(VIWO_PARAM(t_OtoI_s),
      {.unit = "s", .min = -10., .max = 10., .help = "t_imu = t_odom + t_OtoI"});
    log::JointParams::bind(b);
    sim::DriveParams::bind(b);
    sim::RigParams::bind(b);
  }
};

/// `ideal`: rigid wheels that do as they are told.
inline Physics physics_from(const Params& params, bool ideal) {
  Physics out;
  out.gravity_m_per_s2 = params.gravity_m_per_s2;
  out.mass_kg = params.mass_kg;
  out.com_m = params.com_m;
  out.inertia_kgm2 = params.inertia_kgm2;
  if (ideal) return out;
  out.slip_per_load = params.slip_per_load;
  out.slip_angle_per_load_rad = params.slip_angle_per_load_rad;
  if ((out.slip_per_load > 0.) != (out.slip_angle_per_load_rad > 0.)) {
    throw ParamError("slip_angle_per_load_rad",
                     "tyres that slip slip in both directions, those "
                     "that do not (slip_per_load: 0) in none");
  }
  out.load_exponent = params.load_exponent;
  out.friction = params.friction;
  out.rolling_resistance = params.rolling_resistance;
  out.radius_loss_m_per_n = params.radius_loss_m_per_n;
  out.steer_play_rad = params.steer_play_rad;
  out.steer_lag_s = params.steer_lag_s;
  return out;
}

/// `ideal`: without resolution and play.
inline EncoderErrors encoder_errors_from(const Params& params, bool ideal, bool noise) {
  EncoderErrors out;
  if (!ideal) {
    out.drive_resolution_rad = params.drive_resolution_rad;
    out.steer_resolution_rad = params.steer_resolution_rad;
    out.drive_play_rad = params.drive_play_rad;
  }
  if (noise) {
    out.sigma_drive_rad_per_s = params.sigma_drive_rad_per_s;
    out.sigma_steer_rad = params.sigma_steer_rad;
  }
  return out;
}

}  // namespace viwo::contact
