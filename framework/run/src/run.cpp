#include "viwo/run/run.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <span>
#include <string>

#include <Eigen/Dense>

#include "viwo/eval/consistency.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/plausibility/periods.hpp"
#include "viwo/plausibility/plausibility.hpp"
#include "viwo/run/warnings.hpp"
#include "viwo/wheel/held_gauge.hpp"

namespace viwo {

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

const char* status_text(const RunResult& result) {
  const bool doubtful = result.status == RunStatus::kOk && !result.doubts.empty();
  return doubtful ? "doubtful" : name(result.status);
}

std::string reason(const RunResult& result) {
  if (!result.cause.empty() || result.doubts.empty()) return result.cause;
  return result.doubts.front();
}

namespace {

StampedPose stamped(std::int64_t t_ns, const Eigen::Vector3d& pose) {
  const Eigen::AngleAxisd about_z(pose[0], Eigen::Vector3d::UnitZ());
  return {t_ns, {pose[1], pose[2], 0.}, Eigen::Quaterniond(about_z)};
}

/// Instants of the estimate, in the wheel clock: every epoch_s from the first to the last instant
/// that wheels (and reference) cover.
std::vector<std::int64_t> epoch_stamps(const RunSetup& setup, const RunData& data,
                                       std::int64_t offset_ns) {
  std::int64_t begin_ns = data.wheels().front().begin_ns;
  std::int64_t end_ns = data.wheels().back().end_ns;
  if (!data.reference.empty()) {
    begin_ns = std::max(begin_ns, data.reference.front().t_ns - offset_ns);
    end_ns = std::min(end_ns, data.reference.back().t_ns - offset_ns);
  }
  if (begin_ns >= end_ns) {
    throw InputError(
        setup.sensors_mark.text() + "  the encoder samples of '" + data.wheels_name + "' " +
        (data.reference.empty() ? "last no time" : "and the reference have no time in common"));
  }
  const auto period_ns = std::max<std::int64_t>(1, to_ns(setup.epoch_s));
  if (const std::string fault = fault_of_times(data.wheels(), setup.epoch_s); !fault.empty()) {
    throw InputError(setup.sensors_mark.text() + "  the encoder samples of '" + data.wheels_name +
                     "' " + fault);
  }
  std::vector<std::int64_t> stamps;
  for (std::int64_t t_ns = begin_ns; t_ns < end_ns; t_ns += period_ns) {
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
  double mean() const { return count_ > 0 ? sum_ / count_ : std::nan(""); }

 private:
  double sum_ = 0.;
  int count_ = 0;
};

/// Intrinsics of the drawing, in whose frame nothing is held; else they are those of a file.
bool is_as_drawn(const RunSetup& setup) {
  return setup.x_WI == setup.model->nominal() && setup.sigma == setup.model->prior_sigma();
}

/// In the frame of the intrinsics; nothing if one of them is not known.
std::optional<Intrinsics> true_intrinsics(const RunSetup& setup, const RunData& data) {
  WheelsView truth;
  truth.x_WI = setup.x_WI;
  for (int i = 0; i < setup.model->n_intrinsics(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const auto known = data.calibration.find(setup.model->description().intrinsics[k].name);
    if (known == data.calibration.end()) return std::nullopt;
    truth.x_WI[i] = known->second;
  }
  if (!is_as_drawn(setup)) move_to_held_gauge(*setup.model, setup.x_WI, truth);
  return truth.x_WI;
}

/// Nothing is estimated while running here: the same at the start and at the end.
std::vector<CalibrationTrack> constant_tracks(const RunSetup& setup, const Intrinsics& sigma,
                                              const RunData& data) {
  const std::optional<Intrinsics> truth = true_intrinsics(setup, data);
  std::vector<CalibrationTrack> tracks;
  for (int i = 0; i < setup.model->n_intrinsics(); ++i) {
    CalibrationTrack& track = tracks.emplace_back();
    const IntrinsicSpec& spec = setup.model->description().intrinsics[static_cast<std::size_t>(i)];
    track.name = spec.name;
    track.unit = spec.unit;
    track.estimate.assign(2, setup.x_WI[i]);
    track.sigma.assign(2, sigma[i]);
    if (truth) {
      track.truth = (*truth)[i];
      track.final_error = setup.x_WI[i] - (*truth)[i];
    }
  }
  return tracks;
}

/// What the samples alone say against the estimate.
void look_at_samples(const RunSetup& setup, const RunData& data, RunResult& result) {
  const std::int64_t begin_ns = data.wheels().front().begin_ns;
  for (Finding& finding :
       implausible(setup, {data.imu(), data.wheels(), data.headings()}, begin_ns)) {
    (finding.is_doubt ? result.doubts : result.warnings).push_back(std::move(finding.text));
  }
}

/// Integrates the wheels over the next epoch; false with the cause where that is no pose.
bool add_epoch(Preintegrator& preintegrator, std::span<const EncoderSample> wheels,
               std::span<const std::int64_t> stamps, std::size_t k, PreintegratedPose& interval,
               RunResult& result) {
  const auto clock_begin = std::chrono::steady_clock::now();
  const std::string epoch = std::to_string(k);
  try {
    preintegrator.integrate(wheels, stamps[k - 1], stamps[k], interval);
  } catch (const PluginFailure& failure) {
    result.status = RunStatus::kFailed;
    result.cause = std::string(failure.what()) + " (epoch " + epoch + ")";
    return false;
  }
  append(result.total, interval);
  const std::chrono::duration<double, std::milli> spent =
      std::chrono::steady_clock::now() - clock_begin;
  const double t_s = seconds_between(stamps.front(), stamps[k]);
  result.epoch_ms.emplace_back(t_s, spent.count());
  ++result.epochs;
  if (result.total.g.allFinite() && result.total.P_g.allFinite()) return true;
  result.status = RunStatus::kDiverged;
  result.cause = "the pose is not finite after epoch " + epoch + " (" + std::to_string(t_s) + " s)";
  return false;
}

}  // namespace

RunResult run_odometry(const RunSetup& setup, const RunData& data) {
  RunResult result;
  result.rejections = data.rejections;
  result.warnings = setup.warnings;
  result.reference = data.reference;
  const auto offset_ns = to_ns(setup.reference_time_offset_s);
  const auto stamps = epoch_stamps(setup, data, offset_ns);
  const Eigen::Vector3d O_in_B = as_se2(setup.extrinsics.value_or(PlanarExtrinsics::Zero()));
  const Eigen::Vector3d B_in_O = between(O_in_B, Eigen::Vector3d::Zero());
  const auto reference_at = [&](std::int64_t t_ns) {
    return interpolate(data.reference, t_ns + offset_ns, setup.evaluation.max_reference_gap_s);
  };
  const auto start = reference_at(stamps.front());
  const Eigen::Vector3d B_start = start ? planar(*start) : Eigen::Vector3d::Zero();
  const Eigen::Vector3d O_start = compose(B_start, O_in_B);

  const Intrinsics sigma = is_as_drawn(setup) ? setup.model->drawn_sigma() : setup.sigma;
  const auto wheels = data.wheels();
  Preintegrator preintegrator(setup.model, setup.preintegration);
  preintegrator.set_intrinsics(setup.x_WI);
  PreintegratedPose interval;
  result.total.reset(setup.model->n_intrinsics());
  PlanarNees nees;
  result.estimate.push_back(stamped(stamps.front() + offset_ns, B_start));
  const auto wall_begin = std::chrono::steady_clock::now();
  for (std::size_t k = 1; k < stamps.size() && result.status == RunStatus::kOk; ++k) {
    if (!add_epoch(preintegrator, wheels, stamps, k, interval, result)) break;
    const Eigen::Vector3d O_now = compose(O_start, result.total.g);
    result.estimate.push_back(stamped(stamps[k] + offset_ns, compose(O_now, B_in_O)));
    if (const auto truth = reference_at(stamps[k]); truth && start) {
      const auto scaled = (result.total.J_g_WI * sigma.asDiagonal()).eval();
      const Eigen::Matrix3d P = result.total.P_g + scaled * scaled.transpose();
      nees.add(result.total.g, between(O_start, compose(planar(*truth), O_in_B)), P);
    }
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - wall_begin;
  result.wall_s = wall.count();
  result.duration_s = result.epoch_ms.empty() ? 0. : result.epoch_ms.back().first;
  std::vector<double> spent_ms;
  for (const auto& [t_s, ms] : result.epoch_ms) spent_ms.push_back(ms);
  result.total_ms = stage_time(spent_ms);
  result.stages = {{"preintegration", result.total_ms}};
  result.epoch_t_s = {0., result.duration_s};
  result.calibration = constant_tracks(setup, sigma, data);
  if (result.status == RunStatus::kOk && result.total.rejected >= result.total.samples) {
    result.status = RunStatus::kFailed;
    result.cause = "none of the encoder samples could be used";
  }
  if (result.status == RunStatus::kOk && !data.reference.empty()) {
    compare(data.reference, setup, result);
    result.nees_planar = nees.mean();
  }
  look_at_samples(setup, data, result);
  doubt(result);
  return result;
}

}  // namespace viwo
