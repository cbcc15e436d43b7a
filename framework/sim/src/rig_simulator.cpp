#include "viwo/sim/rig_simulator.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "viwo/api/status.hpp"
#include "viwo/math/rpy.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/sim/true_cameras.hpp"

namespace viwo::sim {
namespace {

ImuSimulation imu_from(const RigParams& params, double duration_s, std::int64_t start_ns,
                       bool exact) {
  ImuSimulation imu;
  imu.duration_s = duration_s;
  imu.start_ns = start_ns;
  imu.rate_hz = params.imu_rate_hz;
  imu.gravity_m_per_s2 = params.gravity_m_per_s2;
  imu.noise = params.noise && !exact;
  imu.densities = params.densities();
  imu.gyro_bias = params.gyro_bias_rad_per_s;
  imu.accel_bias = params.accel_bias_m_per_s2;
  imu.sigma_gyro_bias_rad_per_s = params.sigma_gyro_bias_rad_per_s;
  imu.sigma_accel_bias_m_per_s2 = params.sigma_accel_bias_m_per_s2;
  return imu;
}

FeatureSimulation features_from(const RigParams& params, double duration_s, std::int64_t start_ns,
                                bool exact) {
  FeatureSimulation features;
  features.duration_s = duration_s;
  features.start_ns = start_ns;
  features.rate_hz = params.camera_rate_hz;
  features.phase_s = params.camera_phase_s;
  features.features = params.features;
  features.landmark_min_m = params.landmark_min_m;
  features.landmark_max_m = params.landmark_max_m;
  features.max_view_angle_rad = params.max_view_angle_rad;
  features.sigma_px = params.sigma_px;
  features.noise = params.noise && !exact;
  features.outlier_probability = exact ? 0. : params.feature_outlier_probability;
  features.outlier_px = params.feature_outlier_px;
  features.dropout_probability = exact ? 0. : params.feature_dropout_probability;
  if (features.landmark_max_m < features.landmark_min_m) {
    throw ParamError("landmark_max_m", "is less than landmark_min_m");
  }
  return features;
}

std::vector<CameraView> cameras_from(const RigParams& params, const HostServices& services) {
  if (params.cameras.empty()) {
    throw ParamError("cameras", "a file is needed, or features: 0");
  }
  return true_cameras(params, cameras_of_file(params.cameras, params.n_cameras), services);
}

}  // namespace

RigSimulation rig_from(const RigParams& params, double duration_s, std::int64_t start_ns,
                       const HostServices& services) {
  RigSimulation rig;
  rig.mounting = {rotation_of_rpy(params.rpy_ItoO_rad), params.p_IinO_m};
  rig.with_imu = params.imu;
  rig.imu = imu_from(params, duration_s, start_ns, services.exact);
  rig.features = features_from(params, duration_s, start_ns, services.exact);
  if (rig.features.features > 0) rig.cameras = cameras_from(params, services);
  return rig;
}

SampleTypes rig_kinds(const RigParams& params) {
  SampleTypes out = sample_types<StateSample>();
  if (params.imu) out.push_back(&sample_type<ImuSample>());
  if (params.features > 0) {
    out.push_back(&sample_type<FeatureSample>());
    out.push_back(&sample_type<CalibrationSample>());
  }
  return out;
}

double rig_end_s(const RigSimulation& rig) {
  return std::max(imu_end_s(rig.imu), rig.features.duration_s);
}

std::vector<Measurement> simulate_rig(const BodyTrajectory& trajectory, const RigSimulation& rig,
                                      std::uint64_t seed) {
  const SimulatedImu imu = simulate_imu(trajectory, rig.mounting, rig.imu, seed);
  const std::int64_t start_ns = rig.imu.start_ns;
  std::vector<Measurement> out;
  for (CalibrationSample& truth : camera_truth(rig.cameras, start_ns)) {
    out.emplace_back(std::move(truth));
  }
  const auto add_state = [&](std::int64_t t_ns) {
    out.emplace_back(true_state(trajectory, rig.mounting, imu, start_ns, t_ns));
  };
  add_state(start_ns);
  for (const std::int64_t t_ns : image_times_ns(rig.features)) {
    if (t_ns > 0) add_state(start_ns + t_ns);
  }
  if (rig.with_imu) out.insert(out.end(), imu.samples.begin(), imu.samples.end());
  if (!rig.cameras.empty()) {
    SimulatedFeatures features =
        simulate_features(trajectory, rig.mounting, rig.cameras, rig.features, seed);
    for (FeatureSample& sample : features.samples) out.emplace_back(std::move(sample));
  }
  return out;
}

std::vector<CalibrationSample> mounting_truth(const Mounting& mounting, std::int64_t t_ns) {
  const Eigen::Vector3d theta = log_so3(mounting.R_ItoO);
  std::vector<CalibrationSample> out;
  for (int i = 0; i < 3; ++i) {
    out.push_back({t_ns, std::string("theta_ItoO_") + "xyz"[i], theta[i]});
  }
  for (int i = 0; i < 3; ++i) {
    out.push_back({t_ns, std::string("p_IinO_") + "xyz"[i], mounting.p_IinO[i]});
  }
  return out;
}

void sort_by_time(std::vector<Measurement>& measurements) {
  std::stable_sort(
      measurements.begin(), measurements.end(),
      [](const Measurement& a, const Measurement& b) { return stamp_ns(a) < stamp_ns(b); });
}

}  // namespace viwo::sim
