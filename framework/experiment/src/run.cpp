#include "viwo/experiment/run.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/Dense>

#include "viwo/eval/consistency.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/se2.hpp"

namespace viwo::experiment {

const char* name(RunStatus status) {
  switch (status) {
    case RunStatus::kOk:
      return "ok";
    case RunStatus::kDiverged:
      return "diverged";
    case RunStatus::kFailed:
      break;
  }
  return "failed";
}

namespace {

StampedPose planar_pose(std::int64_t t_ns, const std::array<double, 3>& p,
                        const Eigen::Quaterniond& q) {
  const Eigen::AngleAxisd about_z(yaw(q), Eigen::Vector3d::UnitZ());
  return {t_ns, {p[0], p[1], 0.}, Eigen::Quaterniond(about_z)};
}

/// A model's complaint about the channels of a sensor, at the position of the model or the sensors.
void require_channels(const WheelModel& model, const config::Mark& mark,
                      const EncoderSample& sample, const std::string& sensor) {
  try {
    model.require_channels(sample, "sensors." + sensor);
  } catch (const InputError& error) {
    config::fail(mark, error.what());
  }
}

/// The same for the first sample of a sensor that gives those of a further wheel set.
void require_channels_of_set(const RunSetup& setup, const EncoderSample& sample,
                             const std::string& sensor) {
  for (const WheelSet& wheels : setup.filter->wheels) {
    if (wheels.sensor != sensor) continue;
    require_channels(*wheels.model, setup.sensors_mark, sample, sensor);
  }
}

void require_what_the_filter_needs(const RunSetup& setup, const RunData& data) {
  if (data.imu.empty()) config::fail(setup.sensors_mark, "no sensor of this run gave IMU samples");
  if (setup.filter->start.mode == StartMode::kReference && data.states.empty()) {
    config::fail(setup.sensors_mark,
                 "no sensor of this run gave reference states, which estimator.start: reference "
                 "needs - choose start: standstill or moving");
  }
}

}  // namespace

RunData collect(RunSetup& setup) {
  RunData data;
  std::string reference_name, imu_name, images_name;
  const auto claim = [&setup](std::string& owner, const std::string& sensor, const char* what) {
    if (owner.empty()) owner = sensor;
    if (owner != sensor) {
      config::fail(setup.sensors_mark, "both '" + owner + "' and '" + sensor + "' give " + what +
                                           ": a run takes them from one sensor");
    }
  };
  const std::string wheels_sensor =
      setup.filter && !setup.filter->wheels.empty() ? setup.filter->wheels.front().sensor : "";
  for (auto& entry : setup.sensors) {
    const std::string& name = entry.first;
    const Loaded<Sensor>& sensor = entry.second;
    guarded(sensor.info, "next", [&] {
      Measurement measurement;
      while (sensor.object->next(measurement) == Status::kOk) {
        if (const auto* encoders = std::get_if<EncoderSample>(&measurement)) {
          if (!wheels_sensor.empty() && name != wheels_sensor) {
            auto& samples = data.other_wheels[name];
            if (samples.empty()) require_channels_of_set(setup, *encoders, name);
            samples.push_back(*encoders);
            continue;
          }
          claim(data.wheels_name, name, "encoder samples");
          if (data.samples.empty() && setup.model) {
            require_channels(*setup.model, setup.kinematics_mark, *encoders, name);
          }
          data.samples.push_back(*encoders);
        } else if (const auto* pose = std::get_if<PoseSample>(&measurement)) {
          const auto& measured = setup.measured_poses;
          if (std::find(measured.begin(), measured.end(), name) != measured.end()) {
            data.poses[name].push_back(*pose);
            continue;
          }
          claim(reference_name, name, "reference poses");
          data.reference.push_back(
              planar_pose(pose->t_ns, pose->p_BinW_m, to_quaternion(pose->q_BtoW_xyzw)));
        } else if (const auto* imu = std::get_if<ImuSample>(&measurement)) {
          claim(imu_name, name, "IMU samples");
          data.imu.push_back(*imu);
        } else if (auto* image = std::get_if<FeatureSample>(&measurement)) {
          claim(images_name, name, "images");
          data.images.push_back(*image);
        } else if (const auto* state = std::get_if<StateSample>(&measurement)) {
          claim(reference_name, name, "reference states");
          data.states.push_back(*state);
        } else if (const auto* truth = std::get_if<CalibrationSample>(&measurement)) {
          data.calibration[truth->name] = truth->value;
        }
      }
      std::vector<RejectionCount> rejections;
      sensor.object->rejections(rejections);
      for (RejectionCount& rejection : rejections) data.rejections.emplace_back(name, rejection);
    });
  }
  // Of a sensor that also knows the states, poses are measurements, here without an update.
  if (!data.states.empty()) data.reference.clear();
  if (setup.filter) {
    require_what_the_filter_needs(setup, data);
    return data;
  }
  if (data.samples.empty()) {
    config::fail(setup.sensors_mark, "no sensor of this run gave encoder samples");
  }
  // States are those of the IMU: then it is the reference body.
  if (!data.states.empty() && setup.O_in_I) setup.extrinsics = *setup.O_in_I;
  for (const StateSample& state : data.states) {
    data.reference.push_back(
        planar_pose(state.t_ns, state.p_IinG_m, to_quaternion(state.q_ItoG_xyzw)));
  }
  return data;
}

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

StampedPose stamped(std::int64_t t_ns, const Eigen::Vector3d& pose) {
  const Eigen::AngleAxisd about_z(pose[0], Eigen::Vector3d::UnitZ());
  return {t_ns, {pose[1], pose[2], 0.}, Eigen::Quaterniond(about_z)};
}

/// Instants of the estimate, in the wheel clock: every epoch_s from the first to the last instant
/// that wheels (and reference) cover.
std::vector<std::int64_t> epoch_stamps(const RunSetup& setup, const RunData& data,
                                       std::int64_t offset_ns) {
  std::int64_t begin_ns = data.samples.front().begin_ns;
  std::int64_t end_ns = data.samples.back().end_ns;
  if (!data.reference.empty()) {
    begin_ns = std::max(begin_ns, data.reference.front().t_ns - offset_ns);
    end_ns = std::min(end_ns, data.reference.back().t_ns - offset_ns);
  }
  if (begin_ns >= end_ns) {
    throw InputError("the encoder samples of '" + data.wheels_name +
                     "' and the reference have no time in common");
  }
  const auto period_ns = static_cast<std::int64_t>(std::llround(setup.epoch_s * 1e9));
  std::vector<std::int64_t> stamps;
  for (std::int64_t t_ns = begin_ns; t_ns < end_ns; t_ns += std::max<std::int64_t>(period_ns, 1)) {
    stamps.push_back(t_ns);
  }
  stamps.push_back(end_ns);
  return stamps;
}

/// Mean over the epochs of the squared error of the odometry since the start, normalised by what
/// encoder noise and the uncertainty of the intrinsics explain. The error is the logarithm of the
/// estimate seen from the truth, in which the bent clouds of dead reckoning are nearly Gaussian.
class PlanarNees {
 public:
  /// P is the covariance of `estimate` as [theta, x, y].
  void add(const Eigen::Vector3d& estimate, const Eigen::Vector3d& reference,
           const Eigen::Matrix3d& P) {
    Eigen::Matrix3d into_body = Eigen::Matrix3d::Identity();
    into_body.block<2, 2>(1, 1) = R2(-estimate[0]);
    const double value =
        eval::nees(log_se2(between(reference, estimate)), into_body * P * into_body.transpose());
    if (!std::isfinite(value)) return;
    sum_ += value;
    ++count_;
  }
  double mean() const { return count_ > 0 ? sum_ / count_ : kNan; }

 private:
  double sum_ = 0.;
  int count_ = 0;
};

}  // namespace

StageTime stage_time(std::vector<double> ms) {
  StageTime stage;
  if (ms.empty()) return stage;
  stage.mean_ms = std::accumulate(ms.begin(), ms.end(), 0.) / static_cast<double>(ms.size());
  std::sort(ms.begin(), ms.end());
  stage.p95_ms = ms[(ms.size() - 1) * 95 / 100];
  stage.max_ms = ms.back();
  return stage;
}

RunResult run_odometry(const RunSetup& setup, const RunData& data) {
  RunResult result;
  result.rejections = data.rejections;
  result.reference = data.reference;
  const auto offset_ns =
      static_cast<std::int64_t>(std::llround(setup.reference_time_offset_s * 1e9));
  const auto stamps = epoch_stamps(setup, data, offset_ns);
  const Eigen::Vector3d O_in_B(setup.extrinsics[2], setup.extrinsics[0], setup.extrinsics[1]);
  const Eigen::Vector3d B_in_O = between(O_in_B, Eigen::Vector3d::Zero());
  const auto reference_at = [&](std::int64_t t_ns) {
    return interpolate(data.reference, t_ns + offset_ns, setup.reference_max_gap_s);
  };
  const auto start = reference_at(stamps.front());
  const Eigen::Vector3d B_start = start ? planar(*start) : Eigen::Vector3d::Zero();
  const Eigen::Vector3d O_start = compose(B_start, O_in_B);

  Preintegrator preintegrator(setup.model, setup.preintegration);
  preintegrator.set_intrinsics(setup.x_WI);
  PreintegratedPose interval;
  result.total.reset(setup.model->n_intrinsics());
  PlanarNees nees;
  result.estimate.push_back(stamped(stamps.front() + offset_ns, B_start));
  const auto wall_begin = std::chrono::steady_clock::now();
  for (std::size_t k = 1; k < stamps.size() && result.status == RunStatus::kOk; ++k) {
    const auto epoch_begin = std::chrono::steady_clock::now();
    try {
      preintegrator.integrate(data.samples, stamps[k - 1], stamps[k], interval);
    } catch (const PluginFailure& failure) {
      result.status = RunStatus::kFailed;
      result.cause = std::string(failure.what()) + " (epoch " + std::to_string(k) + ")";
      break;
    }
    append(result.total, interval);
    const std::chrono::duration<double, std::milli> spent =
        std::chrono::steady_clock::now() - epoch_begin;
    const double t_s = seconds_between(stamps.front(), stamps[k]);
    result.epoch_ms.emplace_back(t_s, spent.count());
    ++result.epochs;
    if (!result.total.g.allFinite() || !result.total.P_g.allFinite()) {
      result.status = RunStatus::kDiverged;
      result.cause = "the pose is not finite after epoch " + std::to_string(k) + " (" +
                     std::to_string(t_s) + " s)";
      break;
    }
    const Eigen::Vector3d O_now = compose(O_start, result.total.g);
    result.estimate.push_back(stamped(stamps[k] + offset_ns, compose(O_now, B_in_O)));
    if (const auto truth = reference_at(stamps[k]); truth && start) {
      const auto scaled = (result.total.J_g_WI * setup.sigma.asDiagonal()).eval();
      const Eigen::Matrix3d P = result.total.P_g + scaled * scaled.transpose();
      nees.add(result.total.g, between(O_start, compose(planar(*truth), O_in_B)), P);
    }
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - wall_begin;
  result.wall_s = wall.count();
  result.duration_s = seconds_between(stamps.front(), stamps.back());
  std::vector<double> spent_ms;
  for (const auto& [t_s, ms] : result.epoch_ms) spent_ms.push_back(ms);
  result.total_ms = stage_time(spent_ms);
  result.stages = {{"preintegration", result.total_ms}};
  // Nothing is estimated while running here: the same at the start and at the end.
  result.epoch_t_s = {0., result.duration_s};
  for (int i = 0; i < setup.model->n_intrinsics(); ++i) {
    CalibrationTrack track;
    track.name = setup.model->description().intrinsics[static_cast<std::size_t>(i)].name;
    track.estimate.assign(2, setup.x_WI[i]);
    track.sigma.assign(2, setup.sigma[i]);
    if (const auto truth = data.calibration.find(track.name); truth != data.calibration.end()) {
      track.truth = truth->second;
      track.final_error = setup.x_WI[i] - truth->second;
    }
    result.calibration.push_back(std::move(track));
  }
  if (result.status == RunStatus::kOk && result.total.rejected >= result.total.samples) {
    result.status = RunStatus::kFailed;
    result.cause = "none of the encoder samples could be used";
  }
  if (result.status == RunStatus::kOk && !data.reference.empty()) {
    result.accuracy = eval::evaluate(data.reference, result.estimate, setup.evaluation);
    result.nees_planar = nees.mean();
  }
  return result;
}

}  // namespace viwo::experiment
