#include "viwo/robot/robot.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "viwo/api/auto_kinematics.hpp"
#include "viwo/estimator/estimator.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/sim/encoder_simulator.hpp"
#include "viwo/sim/rig_simulator.hpp"

namespace viwo::robot {
namespace {

constexpr std::int64_t kStart = 1'000'000'000;
constexpr double kPoseRateHz = 20.;
constexpr int kPosesPerFix = 4;

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

CameraPrior camera_prior(Calibration calibration) {
  CameraPrior prior;
  prior.camera = camera();
  if (calibration == Calibration::kHeld) return prior;
  prior.sigma_extrinsics << 0.005, 0.005, 0.005, 0.01, 0.01, 0.01;
  prior.sigma_intrinsics << 1., 1., 1., 1., 0.01, 0.01, 0.001, 0.001;
  prior.sigma_clock_s = 0.002;
  return prior;
}

WheelsPrior wheels_prior(Calibration calibration) {
  WheelsPrior prior;
  const ModelDescription description = base_description();
  prior.wheels.model = &base();
  prior.wheels.R_ItoO = mounting().R_ItoO;
  prior.wheels.p_IinO = mounting().p_IinO;
  prior.wheels.x_WI = nominal_intrinsics(description);
  prior.sigma_intrinsics.setZero(prior.wheels.x_WI.size());
  if (calibration == Calibration::kHeld) return prior;
  prior.sigma_extrinsics.setConstant(0.01);
  prior.sigma_time_offset_s = 0.005;
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
  pose.t_ns = kStart + to_ns(t_s);
  pose.p_BinW_m = {motion.p_BinG.x(), motion.p_BinG.y(), motion.p_BinG.z()};
  pose.q_BtoW_xyzw = {q.x(), q.y(), q.z(), q.w()};
  return pose;
}

/// Where a pose is when W is east, north, up at a place of the ellipsoid.
GnssSample fix_at(const PoseSample& pose) {
  constexpr double kLatitude = 0.8, kLongitude = 0.28, kAltitude_m = 120.;
  constexpr double kAxis_m = 6378137., kEccentricity2 = 6.69437999014e-3;
  constexpr double kDegrees = 180. / std::numbers::pi;
  const double sine = std::sin(kLatitude);
  const double w2 = 1. - kEccentricity2 * sine * sine;
  const double across_m = kAxis_m / std::sqrt(w2);
  const double along_m = across_m * (1. - kEccentricity2) / w2;
  GnssSample fix;
  fix.t_ns = pose.t_ns;
  fix.latitude_deg = kDegrees * (kLatitude + pose.p_BinW_m[1] / (along_m + kAltitude_m));
  fix.longitude_deg =
      kDegrees * (kLongitude + pose.p_BinW_m[0] / ((across_m + kAltitude_m) * std::cos(kLatitude)));
  fix.altitude_m = kAltitude_m + pose.p_BinW_m[2];
  fix.covariance_ENU_m2 = {1e-4, 0., 0., 0., 1e-4, 0., 0., 0., 4e-4};
  return fix;
}

/// Something to see.
class Stripes final : public ImageSource {
 public:
  void read(Image& out) const override {
    out.width_px = camera().width_px;
    out.height_px = camera().height_px;
    out.pixels.resize(static_cast<std::size_t>(out.width_px) *
                      static_cast<std::size_t>(out.height_px));
    for (std::size_t i = 0; i < out.pixels.size(); ++i) {
      out.pixels[i] = static_cast<std::uint8_t>(i % 97);
    }
  }
};

class Neighbour final : public Update {
 public:
  void declare(Declarations& host) override {
    const CameraBlocks blocks = declare_camera(host, 0);
    declare_wheels(host);
    BlockSpec own{.name = "neighbour.bias"};
    host.block(own.add("neighbour.bias", "", 0., 1.));
    room_ = host.room({.name = "neighbour.points", .blocks = 2, .entries = 3});
    host.stream({.type = &sample_type<FeatureSample>(),
                 .ends_epochs = true,
                 .optional = true,
                 .clocks = {{blocks.middle_constant_s, blocks.clock}}});
  }
  void update(const FilterView& filter, const EpochData& /*data*/, FactorSink& sink) override {
    if (has_point_) return;
    const auto point = sink.add_block(room_, std::array{1., 2., 3.});
    if (!point) return;
    has_point_ = true;
    InformationFactor& factor = sink.add_information();
    factor.columns.add(filter.block(*point).column(), 3);
    factor.Lambda.topLeftCorner<3, 3>().setIdentity();
    factor.eta.head<3>().setZero();
  }

 private:
  RoomId room_;
  bool has_point_ = false;
};

/// Adds what the rig measures, with images at the stamps of the tracks.
void add_rig(const sim::BodyTrajectory& trajectory, double duration_s, std::uint64_t seed,
             bool noise, Drive& drive) {
  sim::RigSimulation rig;
  rig.mounting = mounting();
  rig.cameras = {camera()};
  rig.imu.duration_s = rig.features.duration_s = duration_s;
  rig.imu.start_ns = rig.features.start_ns = kStart;
  rig.features.features = 40;
  rig.imu.noise = rig.features.noise = noise;
  const auto stripes = std::make_shared<Stripes>();
  bool has_start = false;
  for (Measurement& m : sim::simulate_rig(trajectory, rig, seed)) {
    if (const auto* state = m.get_if<StateSample>(); state != nullptr && !has_start) {
      drive.start = *state;
      has_start = true;
    }
    if (m.get_if<FeatureSample>() != nullptr) {
      drive.measurements.emplace_back(ImageSample{m.t_ns(), 0, stripes});
    }
    drive.measurements.push_back(std::move(m));
  }
}

void feed(const Measurement& measurement, Estimator& estimator) {
  if (const auto* imu = measurement.get_if<ImuSample>()) estimator.add(*imu);
  const auto streams = estimator.streams();
  for (std::size_t i = 0; i < streams.size(); ++i) {
    if (*streams[i].spec().type == measurement.view().type()) estimator.add(i, measurement.view());
  }
}

}  // namespace

Drive simulate_drive(const char* motion, double duration_s, bool noise) {
  const sim::BodyTrajectory trajectory =
      sim::BodyTrajectory::drive(sim::PlanarMotion(motion), sim::Ground(), -1., duration_s + 1.);
  constexpr std::uint64_t kSeed = 5;
  Drive drive;
  add_rig(trajectory, duration_s, kSeed, noise, drive);
  sim::EncoderSimulation encoders;
  encoders.duration_s = duration_s;
  encoders.start_ns = kStart;
  encoders.sliding_m_per_s = 0.01;
  encoders.noise = noise;
  for (const EncoderSample& sample : sim::simulate_encoders(
           base(), nominal_intrinsics(base_description()),
           [&](double t_s) { return trajectory.twist(t_s); }, motion, encoders, kSeed)) {
    drive.measurements.emplace_back(sample);
  }
  for (int k = 0; k < static_cast<int>(duration_s * kPoseRateHz); ++k) {
    const PoseSample pose = pose_at(trajectory, k / kPoseRateHz);
    drive.measurements.emplace_back(pose);
    if (k % kPosesPerFix == 0) drive.measurements.emplace_back(fix_at(pose));
  }
  for (const CalibrationSample& truth : sim::mounting_truth(mounting(), kStart)) {
    drive.measurements.emplace_back(truth);
  }
  sim::sort_by_time(drive.measurements);
  return drive;
}

std::shared_ptr<Rig> robot_rig(Calibration calibration) {
  return std::make_shared<Rig>(std::vector{camera_prior(calibration)}, wheels_prior(calibration));
}

std::shared_ptr<Update> make_neighbour() { return std::make_shared<Neighbour>(); }

void run_updates(std::span<const std::shared_ptr<Update>> updates, const std::string& name,
                 const Drive& drive, Calibration calibration) {
  EstimatorOptions options;
  options.monitor.enabled = false;
  options.growing_window = false;
  options.runner.max_update_failures = std::numeric_limits<int>::max();
  std::vector<std::unique_ptr<Estimator>> estimators;
  for (const auto& update : updates) {
    const UpdateEntry neighbour{kNeighbour, make_neighbour(), robot_rig(calibration), ""};
    const UpdateEntry entry{name, update, robot_rig(calibration), ""};
    estimators.push_back(std::make_unique<Estimator>(options, std::vector{neighbour, entry}));
    estimators.back()->start(prior_at(drive.start));
  }
  const auto step = [&] {
    for (bool any = true; any;) {
      any = false;
      for (const auto& estimator : estimators) any = estimator->step() || any;
    }
  };
  for (const Measurement& measurement : drive.measurements) {
    for (const auto& estimator : estimators) feed(measurement, *estimator);
    step();
  }
  for (const auto& estimator : estimators) estimator->finish();
  step();
  for (const auto& estimator : estimators) {
    if (estimator->failure().empty()) continue;
    throw std::runtime_error("the filter diverges with its factors: " + estimator->failure());
  }
}

}  // namespace viwo::robot
