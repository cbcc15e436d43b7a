// What rides on a trajectory: IMU, cameras and the true states, with the parameters that the
// simulating sensors have in common.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "viwo/api/host_services.hpp"
#include "viwo/api/measurement.hpp"
#include "viwo/api/params.hpp"
#include "viwo/sim/body_trajectory.hpp"
#include "viwo/sim/feature_simulator.hpp"
#include "viwo/sim/imu_simulator.hpp"

namespace viwo::sim {

struct RigSimulation {
  Mounting mounting;
  bool with_imu = true;
  ImuSimulation imu;
  FeatureSimulation features;       ///< no images with features.features = 0
  std::vector<CameraView> cameras;  ///< as they truly are; none without images
};

/// Parameters of kRigParams and kTrueCameraParams as they were configured; `duration_s` and
/// `start_ns` are the caller's. With `services.exact` nothing is noisy, missing or off.
/// ParamError for lists of a wrong length, contradictions and a missing camera file.
RigSimulation rig_from(const ParamSet& params, double duration_s, std::int64_t start_ns,
                       const HostServices& services);

/// The kinds of samples that simulate_rig() gives for these parameters.
SampleTypes rig_kinds(const ParamSet& params);

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

// clang-format off
inline constexpr std::array kRigParams{
    ParamSpec{.name = "p_IinO_m", .type = ParamType::kNumbers, .unit = "m",
              .fallback = "[0.05, 0.02, 0.15]", .help = "where the IMU sits on the base"},
    ParamSpec{.name = "rpy_ItoO_rad", .type = ParamType::kNumbers, .unit = "rad",
              .fallback = "[0, 0, 0]", .min = -3.2, .max = 3.2,
              .help = "how it is turned: R_ItoO = Rz(third) Ry(second) Rx(first)"},
    ParamSpec{.name = "imu", .type = ParamType::kBool, .fallback = "true",
              .help = "whether there are IMU samples"},
    ParamSpec{.name = "imu_rate_hz", .type = ParamType::kNumber, .unit = "Hz", .fallback = "200",
              .min = 1., .max = 10000., .help = "rate of the IMU"},
    ParamSpec{.name = "gravity_m_per_s2", .type = ParamType::kNumber, .unit = "m/s^2",
              .fallback = "9.81", .min = 0., .max = 100., .help = "gravity, along -z of G"},
    ParamSpec{.name = "sigma_gyro_rad_per_s_sqrt_hz", .type = ParamType::kNumber,
              .unit = "rad/s/sqrt(Hz)", .fallback = "1.7e-4", .min = 0.,
              .help = "white noise of the gyroscope"},
    ParamSpec{.name = "sigma_accel_m_per_s2_sqrt_hz", .type = ParamType::kNumber,
              .unit = "m/s^2/sqrt(Hz)", .fallback = "2e-3", .min = 0.,
              .help = "white noise of the accelerometer"},
    ParamSpec{.name = "sigma_gyro_walk_rad_per_s2_sqrt_hz", .type = ParamType::kNumber,
              .unit = "rad/s^2/sqrt(Hz)", .fallback = "2e-5", .min = 0.,
              .help = "random walk of the gyroscope's bias"},
    ParamSpec{.name = "sigma_accel_walk_m_per_s3_sqrt_hz", .type = ParamType::kNumber,
              .unit = "m/s^3/sqrt(Hz)", .fallback = "3e-3", .min = 0.,
              .help = "random walk of the accelerometer's bias"},
    ParamSpec{.name = "gyro_bias_rad_per_s", .type = ParamType::kNumbers, .unit = "rad/s",
              .fallback = "[0, 0, 0]", .help = "bias of the gyroscope in the first sample"},
    ParamSpec{.name = "accel_bias_m_per_s2", .type = ParamType::kNumbers, .unit = "m/s^2",
              .fallback = "[0, 0, 0]", .help = "bias of the accelerometer in the first sample"},
    ParamSpec{.name = "sigma_gyro_bias_rad_per_s", .type = ParamType::kNumber, .unit = "rad/s",
              .fallback = "0", .min = 0., .help = "of what is drawn and added to that bias"},
    ParamSpec{.name = "sigma_accel_bias_m_per_s2", .type = ParamType::kNumber, .unit = "m/s^2",
              .fallback = "0", .min = 0., .help = "of what is drawn and added to that bias"},
    ParamSpec{.name = "cameras", .type = ParamType::kPath, .fallback = "",
              .help = "cameras on the IMU, a camera chain file of Kalibr"},
    ParamSpec{.name = "n_cameras", .type = ParamType::kInt, .fallback = "1", .min = 1., .max = 16.,
              .help = "how many of them, from the first"},
    ParamSpec{.name = "camera_rate_hz", .type = ParamType::kNumber, .unit = "Hz", .fallback = "10",
              .min = 0.1, .max = 1000., .help = "rate of the images, and of the true states"},
    ParamSpec{.name = "camera_phase_s", .type = ParamType::kNumber, .unit = "s",
              .fallback = "0.0137", .min = 0., .max = 10.,
              .help = "time of the first images; by default they fall between IMU samples"},
    ParamSpec{.name = "features", .type = ParamType::kInt, .fallback = "200", .min = 0.,
              .max = 5000., .help = "points of an image; 0: no images"},
    ParamSpec{.name = "landmark_min_m", .type = ParamType::kNumber, .unit = "m", .fallback = "5",
              .min = 0., .min_exclusive = true, .help = "smallest distance of new landmarks"},
    ParamSpec{.name = "landmark_max_m", .type = ParamType::kNumber, .unit = "m", .fallback = "7",
              .min = 0., .min_exclusive = true, .help = "largest distance of new landmarks"},
    ParamSpec{.name = "max_view_angle_rad", .type = ParamType::kNumber, .unit = "rad",
              .fallback = "1.4", .min = 0.1, .max = 3.,
              .help = "nothing is seen further off the optical axis"},
    ParamSpec{.name = "sigma_px", .type = ParamType::kNumber, .unit = "px", .fallback = "1",
              .min = 0., .help = "noise of each pixel coordinate"},
    ParamSpec{.name = "feature_outlier_probability", .type = ParamType::kNumber, .fallback = "0",
              .min = 0., .max = 1., .help = "probability that a point is off"},
    ParamSpec{.name = "feature_outlier_px", .type = ParamType::kNumber, .unit = "px",
              .fallback = "30", .min = 0., .help = "by up to how much"},
    ParamSpec{.name = "feature_dropout_probability", .type = ParamType::kNumber, .fallback = "0",
              .min = 0., .max = 1., .help = "probability that an image lacks a point"},
    ParamSpec{.name = "noise", .type = ParamType::kBool, .fallback = "true",
              .help = "all white noise and random walks; not outliers, slip and dropouts"},
};
// clang-format on

}  // namespace viwo::sim
