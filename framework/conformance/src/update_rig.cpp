#include "update_rig.hpp"

#include <cmath>

#include "viwo/api/auto_kinematics.hpp"
#include "viwo/filter/estimator.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/sim/encoder_simulator.hpp"
#include "viwo/sim/rig_simulator.hpp"

namespace viwo::conformance {
namespace {

constexpr std::int64_t kStart = 1'000'000'000;
constexpr double kPoseRateHz = 20.;

/// Two driven wheels on each side and the lateral no-slip row: two rows more than a twist needs.
class FourDrives final : public AutoKinematics<FourDrives> {
 public:
  void describe(ModelDescription& out) const override {
    out.n_drive = 4;
    out.n_rows = 5;
    for (int i = 0; i < 4; ++i) {
      out.intrinsics.push_back(
          {"r_" + std::to_string(i + 1), "m", 0.05 + 0.0001 * i, 0.0005, false, {i, 1}});
      out.noises.push_back({NoiseKind::kDrive, i, 0.001, {i, 1}});
    }
    out.intrinsics.push_back({"baseline", "m", 0.3, 0.005, false, {0, 4}});
    out.noises.push_back({NoiseKind::kSlip, 0, 0.001, {4, 1}});
  }
  template <class T>
  void auto_rows(std::span<const T> drive_rad_per_s, std::span<const T> /*steer_rad*/,
                 std::span<const T> x_WI, AutoRows<T>& out) const {
    for (int i = 0; i < 4; ++i) {
      const auto j = static_cast<std::size_t>(i);
      out.A(i, 0) = T(1.);
      out.A(i, 2) = (i < 2 ? -0.5 : 0.5) * x_WI[4];
      out.b[j] = x_WI[j] * drive_rad_per_s[j];
    }
    out.A(4, 1) = T(1.);
  }
};

const FourDrives& base() {
  static const FourDrives model;
  return model;
}

ModelDescription base_description() {
  ModelDescription description;
  base().describe(description);
  return description;
}

sim::Mounting mounting() {
  sim::Mounting out;
  out.R_ItoO = exp_so3({0., 0., 0.1});
  out.p_IinO = {0.05, 0.02, 0.15};
  return out;
}

/// Looks forward: z of the camera along x of the IMU.
CameraView camera() {
  CameraView view;
  view.width_px = 640;
  view.height_px = 480;
  view.intrinsics << 350., 350., 320., 240., 0., 0., 0., 0.;
  view.R_ItoC << 0., -1., 0., 0., 0., -1., 1., 0., 0.;
  return view;
}

WheelsPrior wheels() {
  WheelsPrior prior;
  const ModelDescription description = base_description();
  prior.wheels.model = &base();
  prior.wheels.R_ItoO = mounting().R_ItoO;
  prior.wheels.p_IinO = mounting().p_IinO;
  prior.wheels.x_WI = sim::nominal_intrinsics(description);
  prior.sigma_extrinsics.setConstant(0.01);
  prior.sigma_time_offset_s = 0.005;
  prior.sigma_intrinsics.resize(prior.wheels.x_WI.size());
  for (std::size_t i = 0; i < description.intrinsics.size(); ++i) {
    prior.sigma_intrinsics[static_cast<Eigen::Index>(i)] = description.intrinsics[i].prior_sigma;
  }
  return prior;
}

ImuPrior prior_at(const StateSample& truth) {
  ImuPrior prior;
  prior.t_ns = truth.t_ns;
  prior.state.R_GtoI = to_quaternion(truth.q_ItoG_xyzw).toRotationMatrix().transpose();
  prior.state.p_IinG = to_vector(truth.p_IinG_m);
  prior.state.v_IinG = to_vector(truth.v_IinG_m_per_s);
  prior.state.gyro_bias = to_vector(truth.gyro_bias_rad_per_s);
  prior.state.accel_bias = to_vector(truth.accel_bias_m_per_s2);
  prior.P = 1e-4 * ImuMatrix::Identity();
  return prior;
}

PoseSample pose_at(const sim::BodyTrajectory& trajectory, double t_s) {
  const sim::BodyMotion motion = trajectory.imu(t_s, mounting());
  const Eigen::Quaterniond q(motion.R_BtoG);
  PoseSample pose;
  pose.t_ns = kStart + static_cast<std::int64_t>(std::llround(1e9 * t_s));
  pose.p_BinW_m = {motion.p_BinG.x(), motion.p_BinG.y(), motion.p_BinG.z()};
  pose.q_BtoW_xyzw = {q.x(), q.y(), q.z(), q.w()};
  return pose;
}

}  // namespace

Drive simulate_drive(const char* motion, double duration_s) {
  const sim::BodyTrajectory trajectory = sim::BodyTrajectory::drive(
      sim::PlanarMotion(motion, {}), sim::Ground(), -1., duration_s + 1.);
  sim::RigSimulation rig;
  rig.mounting = mounting();
  rig.cameras = {camera()};
  rig.imu.duration_s = rig.features.duration_s = duration_s;
  rig.imu.start_ns = rig.features.start_ns = kStart;
  rig.features.features = 40;
  constexpr std::uint64_t kSeed = 5;
  Drive drive;
  bool has_start = false;
  for (Measurement& m : sim::simulate_rig(trajectory, rig, kSeed)) {
    if (const auto* state = std::get_if<StateSample>(&m)) {
      if (!has_start) drive.start = *state;
      has_start = true;
      continue;
    }
    drive.measurements.push_back(std::move(m));
  }
  sim::EncoderSimulation encoders;
  encoders.duration_s = duration_s;
  encoders.start_ns = kStart;
  encoders.sliding_m_per_s = 0.01;
  for (const EncoderSample& sample : sim::simulate_encoders(
           base(), sim::nominal_intrinsics(base_description()),
           [&](double t_s) { return trajectory.twist(t_s); }, motion, encoders, kSeed)) {
    drive.measurements.emplace_back(sample);
  }
  for (int k = 0; k < static_cast<int>(duration_s * kPoseRateHz); ++k) {
    drive.measurements.emplace_back(pose_at(trajectory, k / kPoseRateHz));
  }
  sim::sort_by_time(drive.measurements);
  return drive;
}

std::int64_t run_update(const std::shared_ptr<Update>& update, const Drive& drive) {
  EstimatorOptions options;
  options.monitor.enabled = false;
  options.growing_window = false;
  options.max_update_failures = std::numeric_limits<int>::max();
  CameraPrior camera_prior;
  camera_prior.camera = camera();
  UpdateEntry entry;
  entry.name = "plugin";
  entry.update = update;
  if (update->kind() == UpdateKind::kWheels) entry.wheels = 0;
  if (update->kind() == UpdateKind::kPoses) entry.poses = 0;
  Estimator estimator(options, {camera_prior}, {wheels()}, {entry});
  estimator.start(prior_at(drive.start));
  const auto step = [&] {
    while (estimator.step()) {
    }
  };
  for (const Measurement& measurement : drive.measurements) {
    if (const auto* imu = std::get_if<ImuSample>(&measurement)) estimator.add(*imu);
    if (const auto* image = std::get_if<FeatureSample>(&measurement)) estimator.add(*image);
    if (const auto* cell = std::get_if<EncoderSample>(&measurement)) estimator.add(*cell, 0);
    const auto* pose = std::get_if<PoseSample>(&measurement);
    if (pose != nullptr && entry.poses >= 0) estimator.add(*pose, 0);
    step();
  }
  estimator.finish();
  step();
  if (!estimator.failure().empty()) {
    throw std::runtime_error("the filter diverges with its factors: " + estimator.failure());
  }
  return estimator.epochs();
}

}  // namespace viwo::conformance
