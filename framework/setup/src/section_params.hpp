// Sections of a run configuration that are the host's own.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "viwo/api/params.hpp"
#include "viwo/eval/alignment.hpp"
#include "viwo/setup/filter_setup.hpp"
#include "viwo/sim/imu_params.hpp"

namespace viwo {

struct RunParams {
  std::string name = "run";
  std::uint64_t seed = 1;
  std::filesystem::path calibration;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(name), {.help = "what tables and pages call this run"});
    b(VIWO_PARAM(seed), {.min = 0., .help = "seed of everything random"});
    b(VIWO_PARAM(calibration),
      {.help = "calibration.yaml of a run or of viwo calibrate to start from: values, sigmas and "
               "correlations of wheels and cameras"});
  }
};

struct OdometryParams {
  enum class Twist { kAuto, kPlain, kNoiseWeighted };
  Twist twist = Twist::kAuto;
  double rank_tolerance = 0.01;
  double parity_gate_probability = 0.;
  double epoch_s = 0.1;
  double reference_time_offset_s = 0.;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(twist),
      {{"auto", Twist::kAuto}, {"plain", Twist::kPlain}, {"noise_weighted", Twist::kNoiseWeighted}},
      {.help = "rows of the model weighted equally or by their noise; auto: as the "
               "calibration file was fitted, plain without one"});
    b(VIWO_PARAM(rank_tolerance),
      {.above = 0.,
       .max = 1.,
       .help = "rows whose directions spread less [rad] do not tell the velocity across"});
    b(VIWO_PARAM(parity_gate_probability),
      {.min = 0.,
       .max = 0.5,
       .help = "samples whose parity residual is less likely than this are not believed; 0: "
               "no gate"});
    b(VIWO_PARAM(epoch_s),
      {.unit = "s", .min = 0.001, .help = "time between two poses of the estimate"});
    b(VIWO_PARAM(reference_time_offset_s),
      {.unit = "s",
       .min = -10.,
       .max = 10.,
       .help = "t_reference = t_wheel + offset; where states are the reference, wheels.t_OtoI_s "
               "unless it is written"});
  }
};

struct EvaluationParams {
  eval::Alignment alignment = eval::Alignment::kYawPosition;
  std::vector<double> segment_lengths_m;
  double reference_max_gap_s = 0.5;
  std::vector<double> extrinsics_x_m_y_m_yaw_rad;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(extrinsics_x_m_y_m_yaw_rad),
      {.unit = "m, m, rad",
       .help = "where O is in the body whose measured poses are the reference; none: what the "
               "calibration file says, else that body is O for the wheels alone, and the IMU for a "
               "filter"});
    b(VIWO_PARAM(alignment),
      {{"none", eval::Alignment::kNone},
       {"start", eval::Alignment::kStart},
       {"yaw_position", eval::Alignment::kYawPosition},
       {"se3", eval::Alignment::kSe3}},
      {.help = "how the estimate is brought onto the reference for the absolute error"});
    b(VIWO_PARAM(segment_lengths_m),
      {.unit = "m",
       .above = 0.,
       .help = "path lengths of the relative pose error; none: two that the path has "
               "several of"});
    b(VIWO_PARAM(reference_max_gap_s),
      {.unit = "s", .above = 0., .help = "longest gap of the reference that is interpolated over"});
  }
};

struct EstimatorParams {
  enum class Draw { kGaussian, kSign, kPlus };

  std::string type = "auto";
  int clones = 11;
  Consistency consistency = Consistency::kTransform;
  bool growing_window = true;
  double gravity_m_per_s2 = 9.81;
  double max_epoch_s = 0.25;
  double max_wait_s = 0.2;
  double max_imu_gap_s = 0.05;
  double max_speed_m_per_s = 100.;
  int max_update_failures = 10;
  bool monitor = true;
  double monitor_window_s = 5.;
  double monitor_min_information = 1.;
  bool hold_unexcited = false;
  StartMode start = StartMode::kReference;
  Restart restart = Restart::kLive;
  double start_window_s = 1.;
  double sigma_start_orientation_rad = 0.01;
  double sigma_start_position_m = 0.01;
  double sigma_start_velocity_m_per_s = 0.05;
  double sigma_start_gyro_bias_rad_per_s = 0.02;
  double sigma_start_accel_bias_m_per_s2 = 0.05;
  double start_error_scale = 0.;
  double calibration_error_scale = 0.;
  Draw calibration_error = Draw::kGaussian;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(type), {.choices = "auto|msckf|dead_reckoning",
                         .help = "auto: msckf if the run has updates, else wheel odometry alone"});
    b(VIWO_PARAM(clones), {.min = 2., .max = 100., .help = "past poses kept in the state"});
    b(VIWO_PARAM(consistency),
      {{"transform", Consistency::kTransform},
       {"first_estimates", Consistency::kFirstEstimates},
       {"none", Consistency::kNone}},
      {.help = "what keeps place and yaw of the world unseen: the covariance goes with each "
               "correction of the poses; Jacobians are at first estimates (FEJ); nothing, as in a "
               "plain extended Kalman filter"});
    b(VIWO_PARAM(growing_window),
      {.help = "begin with three clones, one more every third epoch: for a start that may be "
               "wrong; false: for one that is right"});
    b(VIWO_PARAM(gravity_m_per_s2),
      {.unit = "m/s^2", .min = 0., .help = "magnitude of gravity; it points to -z of G"});
    b(VIWO_PARAM(max_epoch_s),
      {.unit = "s",
       .above = 0.,
       .help = "without an image for this long an epoch is made without one"});
    b(VIWO_PARAM(max_wait_s),
      {.unit = "s", .min = 0., .help = "how long an epoch waits for late encoder samples"});
    b(VIWO_PARAM(max_imu_gap_s),
      {.unit = "s",
       .above = 0.,
       .help = "longer spacings of the IMU are gaps: counted, and how the robot moved in them "
               "is unknown"});
    b(VIWO_PARAM(max_speed_m_per_s),
      {.unit = "m/s", .above = 0., .help = "an estimate that is faster has diverged"});
    b(VIWO_PARAM(max_update_failures),
      {.min = 1.,
       .max = 1e9,
       .help = "an update that has thrown in this many epochs is turned off; until then it "
               "is skipped when it throws"});
    b(VIWO_PARAM(monitor),
      {.help = "watch what the motion tells about the calibration of the wheels, and warn"});
    b(VIWO_PARAM(monitor_window_s), {.unit = "s",
                                     .min = 0.5,
                                     .max = 500.,
                                     .help = "how far back the monitor looks, in steps of 0.5 s"});
    b(VIWO_PARAM(monitor_min_information),
      {.min = 0.,
       .help = "directions of which the window tells less than this times the prior are not "
               "excited"});
    b(VIWO_PARAM(hold_unexcited),
      {.help = "such directions get no correction and keep their variance (needs monitor)"});
    b(VIWO_PARAM(start),
      {{"reference", StartMode::kReference},
       {"standstill", StartMode::kStandstill},
       {"moving", StartMode::kMoving}},
      {.help = "first state: of the reference, from a rest (vibration does not matter where images "
               "or wheels see it), or from the motion: by wheels and IMU or, without wheels, "
               "by cameras and IMU (or from a rest, whichever comes first)"});
    b(VIWO_PARAM(restart),
      {{"never", Restart::kNever}, {"live", Restart::kLive}, {"always", Restart::kAlways}},
      {.help = "a filter that has diverged is started again, where it was and with the "
               "calibration of before: in live runs, always (also of recordings), or never"});
    b(VIWO_PARAM(start_window_s),
      {.unit = "s",
       .min = 0.1,
       .max = 60.,
       .help = "how much data a start without reference looks at; from cameras in motion up to "
               "twice that, where this is too short to tell the scale"});
    b(VIWO_PARAM(sigma_start_orientation_rad),
      {.unit = "rad",
       .above = 0.,
       .help = "prior of the first orientation, each axis; of a start without reference its "
               "yaw only"});
    b(VIWO_PARAM(sigma_start_position_m),
      {.unit = "m", .above = 0., .help = "prior of the first position"});
    b(VIWO_PARAM(sigma_start_velocity_m_per_s),
      {.unit = "m/s",
       .above = 0.,
       .help = "prior of the first velocity; start: moving: what slip adds to that of the "
               "wheels; start: standstill, or without wheels: not used"});
    b(VIWO_PARAM(sigma_start_gyro_bias_rad_per_s),
      {.unit = "rad/s", .above = 0., .help = "prior of the gyro bias"});
    b(VIWO_PARAM(sigma_start_accel_bias_m_per_s2),
      {.unit = "m/s^2", .above = 0., .help = "prior of the accelerometer bias"});
    b(VIWO_PARAM(start_error_scale),
      {.min = 0.,
       .help = "simulation: start wrong by this times a draw from the prior (start: reference)"});
    b(VIWO_PARAM(calibration_error_scale),
      {.min = 0.,
       .help = "simulation: calibration starts wrong by this times a draw from its prior, where "
               "the gauge holds entries moved to what they are held at"});
    b(VIWO_PARAM(calibration_error),
      {{"gaussian", Draw::kGaussian}, {"sign", Draw::kSign}, {"plus", Draw::kPlus}},
      {.help = "what that draw is: gaussian, one prior sigma up or down by chance, or one "
               "prior sigma up for all of them and in every run"});
  }
};

struct ImuParams : sim::ImuNoiseParams {
  std::filesystem::path kalibr;
  double range_gyro_rad_per_s = 35.;
  double range_accel_m_per_s2 = 160.;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(kalibr),
      {.help = "Kalibr file with the noises, instead of the four numbers below"});
    sim::ImuNoiseParams::bind(b, true);
    b(VIWO_PARAM(range_gyro_rad_per_s),
      {.unit = "rad/s",
       .above = 0.,
       .help = "readings beyond are left out (35: a little above 2000 deg/s)"});
    b(VIWO_PARAM(range_accel_m_per_s2),
      {.unit = "m/s^2",
       .above = 0.,
       .help = "readings beyond are left out (160: a little above 16 g)"});
  }
};

struct CamerasParams {
  std::filesystem::path kalibr;
  int use = 0;
  double sigma_orientation_rad = 0.005;
  double sigma_position_m = 0.01;
  double relative = 0.1;
  double sigma_focal_px = 1.;
  double sigma_distortion = 0.005;
  double sigma_t_CtoI_s = 0.01;
  bool calibrate = true;
  bool synchronised = true;
  bool calibrate_extrinsics = true;
  bool calibrate_intrinsics = true;
  bool calibrate_time_offset = true;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(kalibr),
      {.required = true,
       .help = "Kalibr camera chain; feature tracks name cameras by their place in it"});
    b(VIWO_PARAM(use), {.min = 0., .help = "use the first n cameras of the file; 0: all"});
    b(VIWO_PARAM(sigma_orientation_rad),
      {.unit = "rad",
       .min = 0.,
       .help = "prior of R_ItoC, each axis; the defaults are what a Kalibr calibration "
               "deserves"});
    b(VIWO_PARAM(sigma_position_m), {.unit = "m", .min = 0., .help = "prior of p_IinC, each axis"});
    b(VIWO_PARAM(relative),
      {.min = 0.001,
       .max = 1.,
       .help = "part of sigma_orientation_rad and sigma_position_m by which a camera is off "
               "against the first, as they were calibrated together; 1: the cameras are known "
               "each by itself"});
    b(VIWO_PARAM(sigma_focal_px),
      {.unit = "px", .min = 0., .help = "prior of focal lengths and principal point"});
    b(VIWO_PARAM(sigma_distortion), {.min = 0., .help = "prior of the distortion coefficients"});
    b(VIWO_PARAM(sigma_t_CtoI_s),
      {.unit = "s",
       .min = 0.,
       .help = "prior of t_CtoI, which starts at timeshift_cam_imu of the Kalibr file"});
    b(VIWO_PARAM(calibrate),
      {.help = "false: the cameras are exactly as in the file: nothing of them is estimated, "
               "and calibration_error_scale leaves them alone"});
    b(VIWO_PARAM(synchronised),
      {.help = "cameras are triggered together and have one clock; false: one each"});
    b(VIWO_PARAM(calibrate_extrinsics), {.help = "estimate R_ItoC and p_IinC"});
    b(VIWO_PARAM(calibrate_intrinsics),
      {.help = "estimate focal lengths, principal point and distortion"});
    b(VIWO_PARAM(calibrate_time_offset), {.help = "estimate t_CtoI"});
  }
};

struct WheelsParams {
  std::string sensor;
  Eigen::Vector3d p_IinO_m{0., 0., 0.};
  Eigen::Vector3d rpy_ItoO_rad{0., 0., 0.};
  double t_OtoI_s = 0.;
  Eigen::Vector3d sigma_p_IinO_m{0.01, 0.01, 0.01};
  Eigen::Vector3d sigma_R_ItoO_rad{0.01, 0.01, 0.01};
  double sigma_t_OtoI_s = 0.01;
  bool hold_gauge = true;
  bool held_are_exact = false;
  bool calibrate_intrinsics = true;
  bool calibrate_extrinsics = true;
  bool calibrate_time_offset = true;
  double intrinsics_walk_per_sqrt_s = 0.;
  double intrinsics_wander = 0.;
  double intrinsics_wander_time_s = 2.;
  std::vector<std::string> intrinsics_wander_of;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(sensor),
      {.help = "sensor that gives the encoder samples; needed when there are several"});
    b(VIWO_PARAM(p_IinO_m), {.unit = "m",
                             .min = -20.,  // more are millimetres
                             .max = 20.,
                             .help = "origin of the IMU in the odometry frame O"});
    b(VIWO_PARAM(rpy_ItoO_rad),
      {.unit = "rad",
       .min = -6.2832,  // more are degrees
       .max = 6.2832,
       .help = "roll, pitch, yaw of I in O: R_ItoO = Rz(yaw) Ry(pitch) Rx(roll)"});
    b(VIWO_PARAM(t_OtoI_s),
      {.unit = "s", .min = -10., .max = 10., .help = "t_imu = t_wheel + t_OtoI"});
    b(VIWO_PARAM(sigma_p_IinO_m),
      {.unit = "m",
       .min = 0.,
       .help = "prior of p_IinO, per axis; 0 holds an axis (the vertical cannot be observed on "
               "flat ground)"});
    b(VIWO_PARAM(sigma_R_ItoO_rad),
      {.unit = "rad",
       .min = 0.,
       .help = "prior of R_ItoO, about the axes of O; 0 holds an axis (roll and pitch are hardly "
               "observed on flat ground)"});
    b(VIWO_PARAM(sigma_t_OtoI_s), {.unit = "s", .min = 0., .help = "prior of t_OtoI"});
    b(VIWO_PARAM(hold_gauge),
      {.help = "hold the intrinsics that place O on the base; false leaves three directions "
               "unobservable, to be looked at (viwo observability)"});
    b(VIWO_PARAM(held_are_exact),
      {.help = "the intrinsics that hold_gauge holds are exactly right on the robot; false: they "
               "are as well known as their prior sigmas say, and what they are off by is in the "
               "priors of the others and of the mount"});
    b(VIWO_PARAM(calibrate_intrinsics),
      {.help = "estimate what the kinematic model gives a prior for"});
    b(VIWO_PARAM(calibrate_extrinsics), {.help = "estimate R_ItoO and p_IinO"});
    b(VIWO_PARAM(calibrate_time_offset), {.help = "estimate t_OtoI"});
    b(VIWO_PARAM(intrinsics_walk_per_sqrt_s),
      {.unit = "prior sigmas/sqrt(s)",
       .min = 0.,
       .help = "random walk of the intrinsics, for what changes while driving (tyres that "
               "warm up or wear); 0: constant"});
    b(VIWO_PARAM(intrinsics_wander),
      {.min = 0.,
       .help = "in prior sigmas, what comes and goes beside each constant intrinsic, a "
               "Gauss-Markov process: play of the steering, slip, tyres on uneven ground; "
               "viwo calibrate finds it; 0: nothing"});
    b(VIWO_PARAM(intrinsics_wander_time_s),
      {.unit = "s", .above = 0., .help = "time constant of intrinsics_wander"});
    b(VIWO_PARAM(intrinsics_wander_of),
      {.help = "what the names of the intrinsics that wander begin with, radii and steering: "
               "[r, delta_o]; none: all wander, also distances that do not"});
  }
};

}  // namespace viwo
