#include "viwo/experiment/run.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/Dense>

#include "calibration_file.hpp"
#include "viwo/config/params.hpp"
#include "viwo/eval/consistency.hpp"
#include "viwo/math/se2.hpp"

namespace viwo::experiment {
namespace {

using config::Node;

constexpr std::array kRunParams{
    ParamSpec{.name = "name",
              .type = ParamType::kString,
              .fallback = "run",
              .help = "what tables and pages call this run"},
    ParamSpec{.name = "seed",
              .type = ParamType::kInt,
              .fallback = "1",
              .min = 0.,
              .help = "seed of everything random"},
};

constexpr std::array kOdometryParams{
    ParamSpec{.name = "twist",
              .type = ParamType::kString,
              .fallback = "auto",
              .choices = "auto|plain|noise_weighted",
              .help = "rows of the model weighted equally or by their noise; auto: as the "
                      "calibration file was fitted, plain without one"},
    ParamSpec{.name = "rank_tolerance",
              .type = ParamType::kNumber,
              .fallback = "0.01",
              .min = 0.,
              .max = 1.,
              .min_exclusive = true,
              .help = "rows whose directions spread less [rad] do not tell the velocity across"},
    ParamSpec{.name = "parity_gate_probability",
              .type = ParamType::kNumber,
              .fallback = "0",
              .min = 0.,
              .max = 0.5,
              .help = "samples whose parity residual is less likely than this are not believed; 0: "
                      "no gate"},
    ParamSpec{.name = "epoch_s",
              .type = ParamType::kNumber,
              .unit = "s",
              .fallback = "0.1",
              .min = 0.001,
              .help = "time between two poses of the estimate"},
    ParamSpec{.name = "reference_time_offset_s",
              .type = ParamType::kNumber,
              .unit = "s",
              .fallback = "0",
              .min = -10.,
              .max = 10.,
              .help = "t_reference = t_wheel + offset"},
};

constexpr std::array kEvaluationParams{
    ParamSpec{.name = "segment_lengths_m",
              .type = ParamType::kNumbers,
              .unit = "m",
              .fallback = "[10, 25]",
              .min = 0.,
              .min_exclusive = true,
              .help = "path lengths of the relative pose error"},
    ParamSpec{.name = "reference_max_gap_s",
              .type = ParamType::kNumber,
              .unit = "s",
              .fallback = "0.5",
              .min = 0.,
              .min_exclusive = true,
              .help = "longest gap of the reference that is interpolated over"},
};

/// The section `key`, or an empty one at the position of the whole.
Node section_or_empty(const Node& run, const char* key) {
  const Node* section = run.find(key);
  return section != nullptr ? *section : Node::empty_map(run.mark());
}

void read_sensors(const Node& run, PluginRegistry& plugins, RunSetup& setup,
                  config::Errors& errors) {
  const Node* sensors = run.find("sensors");
  if (sensors == nullptr || !sensors->is_map() || sensors->entries().empty()) {
    errors.add(sensors != nullptr ? sensors->mark() : run.mark(),
               "'sensors' must be a section that names at least one sensor");
    return;
  }
  setup.sensors_mark = sensors->mark();
  Node resolved = Node::empty_map(sensors->mark());
  std::uint64_t index = 0;
  for (const auto& entry : sensors->entries()) {
    // Sensors of one run have seeds of their own; the same sensor keeps its own in every variant.
    const std::uint64_t seed = setup.seed * 1000 + index++;
    auto loaded = plugins.make_sensor(entry.value, "sensors." + entry.key, seed, errors);
    resolved.set(entry.key, loaded.resolved, entry.key_mark);
    if (loaded.object) setup.sensors.emplace_back(entry.key, std::move(loaded));
  }
  setup.resolved.set("sensors", resolved);
}

void read_kinematics(const Node& run, PluginRegistry& plugins, RunSetup& setup,
                     config::Errors& errors) {
  const Node* section = run.find("kinematics");
  if (section == nullptr) {
    errors.add(run.mark(), "'kinematics' is missing: the section of the kinematic model");
    return;
  }
  setup.kinematics_mark = section->mark();
  constexpr std::string_view kHostKeys[] = {"calibration"};
  setup.kinematics = plugins.make_kinematics(*section, "kinematics", errors, kHostKeys);
  if (!setup.kinematics.object) return;
  setup.model = guarded(setup.kinematics.info, "describe", [&] {
    return std::make_shared<const WheelModel>(setup.kinematics.object);
  });
  setup.x_WI = setup.model->nominal();
  setup.sigma = setup.model->prior_sigma();
  Node resolved = setup.kinematics.resolved;
  if (const Node* file = section->find("calibration")) {
    if (!file->is_scalar()) {
      errors.add(file->mark(), "kinematics.calibration must be the path of a calibration.yaml");
      return;
    }
    const auto path = std::filesystem::absolute(
        std::filesystem::path(file->mark().line > 0 ? file->mark().file : "").parent_path() /
        file->scalar());
    const CalibrationFile calibration =
        read_calibration(path, *setup.model, setup.kinematics.info.name);
    setup.x_WI = calibration.x_WI;
    setup.sigma = calibration.sigma;
    setup.extrinsics = calibration.extrinsics;
    setup.preintegration.twist.noise_weighted = calibration.twist == "noise_weighted";
    resolved.set("calibration", Node::scalar_of(path.lexically_normal().string()));
  }
  setup.resolved.set("kinematics", resolved);
}

void read_options(const Node& run, RunSetup& setup, config::Errors& errors) {
  const Node odometry = section_or_empty(run, "odometry");
  const Node evaluation = section_or_empty(run, "evaluation");
  const std::size_t before = errors.size();
  const ParamSet o =
      config::read_params(odometry, odometry.mark(), "odometry", kOdometryParams, {}, {}, errors);
  const ParamSet e = config::read_params(evaluation, evaluation.mark(), "evaluation",
                                         kEvaluationParams, {}, {}, errors);
  if (errors.size() > before) return;
  if (o.text("twist") != "auto") {
    setup.preintegration.twist.noise_weighted = o.text("twist") == "noise_weighted";
  }
  setup.preintegration.twist.rank_tolerance = o.number("rank_tolerance");
  setup.preintegration.parity_gate_probability = o.number("parity_gate_probability");
  setup.preintegration.parity = false;
  setup.epoch_s = o.number("epoch_s");
  setup.reference_time_offset_s = o.number("reference_time_offset_s");
  const auto lengths = e.numbers("segment_lengths_m");
  setup.evaluation.segment_lengths_m.assign(lengths.begin(), lengths.end());
  setup.evaluation.max_reference_gap_s = e.number("reference_max_gap_s");
  setup.reference_max_gap_s = e.number("reference_max_gap_s");
  setup.resolved.set("odometry", config::write_params(kOdometryParams, o));
  setup.resolved.set("evaluation", config::write_params(kEvaluationParams, e));
}

}  // namespace

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

RunSetup read_run(const Node& run, PluginRegistry& plugins, std::optional<std::uint64_t> seed) {
  RunSetup setup;
  config::Errors errors;
  constexpr std::string_view kSections[] = {"sensors", "kinematics", "odometry", "evaluation"};
  const ParamSet top =
      config::read_params(run, run.mark(), "run", kRunParams, kSections, {}, errors);
  if (errors.empty()) {
    setup.name = top.text("name");
    setup.seed = seed.value_or(static_cast<std::uint64_t>(top.integer("seed")));
    setup.resolved = config::write_params(kRunParams, top);
    setup.resolved.set("seed", Node::scalar_of(std::to_string(setup.seed)));
  } else {
    setup.resolved = Node::empty_map();
  }
  read_kinematics(run, plugins, setup, errors);
  read_options(run, setup, errors);
  read_sensors(run, plugins, setup, errors);
  errors.throw_if_any();
  return setup;
}

namespace {

/// The model's complaint about the channels of a sensor, at the position of the model.
void require_channels(const RunSetup& setup, const EncoderSample& sample,
                      const std::string& sensor) {
  try {
    setup.model->require_channels(sample, "sensors." + sensor);
  } catch (const InputError& error) {
    config::fail(setup.kinematics_mark, error.what());
  }
}

}  // namespace

RunData collect(RunSetup& setup) {
  RunData data;
  std::string reference_name;
  const auto claim = [&setup](std::string& owner, const std::string& sensor, const char* what) {
    if (owner.empty()) owner = sensor;
    if (owner != sensor) {
      config::fail(setup.sensors_mark, "both '" + owner + "' and '" + sensor + "' give " + what +
                                           ": a run takes them from one sensor");
    }
  };
  for (auto& entry : setup.sensors) {
    const std::string& name = entry.first;
    const Loaded<Sensor>& sensor = entry.second;
    guarded(sensor.info, "next", [&] {
      Measurement measurement;
      while (sensor.object->next(measurement) == Status::kOk) {
        if (const auto* encoders = std::get_if<EncoderSample>(&measurement)) {
          claim(data.wheels_name, name, "encoder samples");
          if (data.samples.empty()) require_channels(setup, *encoders, name);
          data.samples.push_back(*encoders);
        } else if (const auto* pose = std::get_if<PoseSample>(&measurement)) {
          claim(reference_name, name, "reference poses");
          const Eigen::Quaterniond q(pose->q_BtoW_xyzw[3], pose->q_BtoW_xyzw[0],
                                     pose->q_BtoW_xyzw[1], pose->q_BtoW_xyzw[2]);
          const Eigen::AngleAxisd about_z(yaw(q), Eigen::Vector3d::UnitZ());
          data.reference.push_back({pose->t_ns,
                                    {pose->p_BinW_m[0], pose->p_BinW_m[1], 0.},
                                    Eigen::Quaterniond(about_z)});
        }
      }
      std::vector<RejectionCount> rejections;
      sensor.object->rejections(rejections);
      for (RejectionCount& rejection : rejections) data.rejections.emplace_back(name, rejection);
    });
  }
  if (data.samples.empty()) {
    config::fail(setup.sensors_mark, "no sensor of this run gave encoder samples");
  }
  return data;
}

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Eigen::Vector3d planar(const StampedPose& pose) {
  return {yaw(pose), pose.p_BinW.x(), pose.p_BinW.y()};
}

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

StageTime stage_time(const std::vector<std::pair<double, double>>& epoch_ms) {
  StageTime stage;
  if (epoch_ms.empty()) return stage;
  std::vector<double> spent;
  for (const auto& [t, ms] : epoch_ms) spent.push_back(ms);
  std::sort(spent.begin(), spent.end());
  stage.mean_ms =
      std::accumulate(spent.begin(), spent.end(), 0.) / static_cast<double>(spent.size());
  stage.p95_ms = spent[(spent.size() - 1) * 95 / 100];
  stage.max_ms = spent.back();
  return stage;
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
    guarded(setup.kinematics.info, "preintegration",
            [&] { preintegrator.integrate(data.samples, stamps[k - 1], stamps[k], interval); });
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
  result.preintegration_ms = stage_time(result.epoch_ms);
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
