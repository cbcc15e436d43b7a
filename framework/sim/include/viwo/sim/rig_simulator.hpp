// What rides on a trajectory: IMU, cameras and the true states, with the parameters that the
// simulating sensors have in common.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "viwo/api/host_services.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/api/params.hpp"
#include "viwo/sim/body_trajectory.hpp"
#include "viwo/sim/feature_simulator.hpp"
#include "viwo/sim/imu_params.hpp"
#include "viwo/sim/imu_simulator.hpp"
#include "viwo/sim/true_cameras.hpp"

namespace viwo::sim {

/// What rides on a base, and how noisy it is.
struct RigParams : ImuNoiseParams, TrueCameraParams {
  Eigen::Vector3d p_IinO_m{0.05, 0.02, 0.15};
  Eigen::Vector3d rpy_ItoO_rad{0., 0., 0.};
  bool imu = true;
  double imu_rate_hz = 200.;
  double gravity_m_per_s2 = 9.81;
  Eigen::Vector3d gyro_bias_rad_per_s{0., 0., 0.};
  Eigen::Vector3d accel_bias_m_per_s2{0., 0., 0.};
  double sigma_gyro_bias_rad_per_s = 0.;
  double sigma_accel_bias_m_per_s2 = 0.;
  std::filesystem::path cameras;
  int n_cameras = 1;
  double camera_rate_hz = 10.;
  double camera_phase_s = 0.0137;
  int features = 200;
  double landmark_min_m = 5.;
  double landmark_max_m = 7.;
  double max_view_angle_rad = 1.4;
  double sigma_px = 1.;
  double feature_outlier_probability = 0.;
  double feature_outlier_px = 30.;
  double feature_dropout_probability = 0.;
  bool noise = true;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(p_IinO_m), {.unit = "m", .help = "where the IMU sits on the base"});
    b(VIWO_PARAM(rpy_ItoO_rad),
      {.unit = "rad",
       .min = -3.2,
       .max = 3.2,
       .help = "how it is turned: R_ItoO = Rz(third) Ry(second) Rx(first)"});
    b(VIWO_PARAM(imu), {.help = "whether there are IMU samples"});
    b(VIWO_PARAM(imu_rate_hz), {.unit = "Hz", .min = 1., .max = 10000., .help = "rate of the IMU"});
    b(VIWO_PARAM(gravity_m_per_s2),
      {.unit = "m/s^2", .min = 0., .max = 100., .help = "gravity, along -z of G"});
    ImuNoiseParams::bind(b);
    b(VIWO_PARAM(gyro_bias_rad_per_s),
      {.unit = "rad/s", .help = "bias of the gyroscope in the first sample"});
    b(VIWO_PARAM(accel_bias_m_per_s2),
      {.unit = "m/s^2", .help = "bias of the accelerometer in the first sample"});
    b(VIWO_PARAM(sigma_gyro_bias_rad_per_s),
      {.unit = "rad/s", .min = 0., .help = "of what is drawn and added to that bias"});
    b(VIWO_PARAM(sigma_accel_bias_m_per_s2),
      {.unit = "m/s^2", .min = 0., .help = "of what is drawn and added to that bias"});
    b(VIWO_PARAM(cameras), {.help = "cameras on the IMU, a camera chain file of Kalibr"});
    b(VIWO_PARAM(n_cameras), {.min = 1., .max = 16., .help = "how many of them, from the first"});
    b(VIWO_PARAM(camera_rate_hz), {.unit = "Hz",
                                   .min = 0.1,
                                   .max = 1000.,
                                   .help = "rate of the images, and of the true states"});
    b(VIWO_PARAM(camera_phase_s),
      {.unit = "s",
       .min = 0.,
       .max = 10.,
       .help = "time of the first images; by default they fall between IMU samples"});
    b(VIWO_PARAM(features), {.min = 0., .max = 5000., .help = "points of an image; 0: no images"});
    b(VIWO_PARAM(landmark_min_m),
      {.unit = "m", .above = 0., .help = "smallest distance of new landmarks"});
    b(VIWO_PARAM(landmark_max_m),
      {.unit = "m", .above = 0., .help = "largest distance of new landmarks"});
    b(VIWO_PARAM(max_view_angle_rad), {.unit = "rad",
                                       .min = 0.1,
                                       .max = 3.,
                                       .help = "nothing is seen further off the optical axis"});
    b(VIWO_PARAM(sigma_px), {.unit = "px", .min = 0., .help = "noise of each pixel coordinate"});
    b(VIWO_PARAM(feature_outlier_probability),
      {.min = 0., .max = 1., .help = "probability that a point is off"});
    b(VIWO_PARAM(feature_outlier_px), {.unit = "px", .min = 0., .help = "by up to how much"});
    b(VIWO_PARAM(feature_dropout_probability),
      {.min = 0., .max = 1., .help = "probability that an image lacks a point"});
    b(VIWO_PARAM(noise),
      {.help = "all white noise and random walks; not outliers, slip and dropouts"});
    TrueCameraParams::bind(b);
  }
};

struct RigSimulation {
  Mounting mounting;
  bool with_imu = true;
  ImuSimulation imu;
  FeatureSimulation features;       ///< no images with features.features = 0
  std::vector<CameraView> cameras;  ///< as they truly are; none without images
};

/// As it was configured; `duration_s` and `start_ns` are the caller's. With `services.exact`
/// nothing is noisy, missing or off. ParamError for lists of a wrong length, contradictions and a
/// missing camera file.
RigSimulation rig_from(const RigParams& params, double duration_s, std::int64_t start_ns,
                       const HostServices& services);

/// The kinds of samples that simulate_rig() gives for these parameters.
SampleTypes rig_kinds(const RigParams& params);

/// What the trajectory must cover for the rig, s.
double rig_end_s(const RigSimulation& rig);

/// The truth of the cameras, true states at the first IMU stamp and at the time of each image (also
/// without images), then IMU samples, then images: not sorted by time.
std::vector<Measurement> simulate_rig(const BodyTrajectory& trajectory, const RigSimulation& rig,
                                      std::uint64_t seed);

/// theta_ItoO_x .. z = Log(R_ItoO) and p_IinO_x .. z.
std::vector<CalibrationSample> mounting_truth(const Mounting& mounting, std::int64_t t_ns);

/// Sorts by stamp; what has the same stamp keeps its order.
void sort_by_time(std::vector<Measurement>& measurements);

}  // namespace viwo::sim
