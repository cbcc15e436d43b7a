#include "run_record.hpp"

// What is kept of each type, in both directions. They are found by the namespace of their type.
namespace nlohmann {

template <>
struct adl_serializer<Eigen::Vector3d> {
  static void to_json(json& out, const Eigen::Vector3d& v) { out = {v.x(), v.y(), v.z()}; }
  static void from_json(const json& in, Eigen::Vector3d& v) {
    for (std::size_t i = 0; i < 3; ++i) v[static_cast<Eigen::Index>(i)] = in.at(i).get<double>();
  }
};

}  // namespace nlohmann

namespace viwo {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RejectionCount, reason, count, first)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(NoiseFound, name, unit, configured, found, count)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(UpdateCounts, applied, rejected)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(UpdateFailures, count, disabled, cause)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PreintegratedPose, g, duration_s, path_length_m, bridged_s,
                                   samples, gated, rejected, rank_deficient)

void to_json(nlohmann::json& out, const StampedPose& pose) {
  const auto& q = pose.q_BtoW;
  out = {pose.t_ns, pose.p_BinW, q.x(), q.y(), q.z(), q.w()};
}

void from_json(const nlohmann::json& in, StampedPose& pose) {
  in.at(0).get_to(pose.t_ns);
  in.at(1).get_to(pose.p_BinW);
  for (std::size_t i = 0; i < 4; ++i) {
    pose.q_BtoW.coeffs()[static_cast<Eigen::Index>(i)] = in.at(i + 2).get<double>();
  }
}

}  // namespace viwo

namespace viwo::eval {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SegmentErrors, length_m, count, mean_m, rmse_m, mean_deg,
                                   rmse_deg)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ErrorSeries, t_s, path_length_m, position_error_m, yaw_error_deg)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Accuracy, alignment, n_poses, n_outside, n_in_gap, duration_s,
                                   path_length_m, ate_m, ate_deg, rpe, end_m, end_deg, end_yaw_deg,
                                   series)

}  // namespace viwo::eval

namespace viwo::experiment {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(StageTime, mean_ms, p95_ms, max_ms)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CalibrationTrack, name, unit, estimate, sigma, truth,
                                   final_error)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PoseNees, pose, position, orientation, relative, series)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PoseError, t_s, position_m, position_sigma_m, yaw_rad,
                                   yaw_sigma_rad)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(UpdateTrack, name, total, failures, applied, rejected)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(MonitorWarning, t_s, text, parameters)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(MonitorTrack, t_s, parameters, sigma_ratio, held, warnings)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunPiece, begin_ns, end_ns, epochs, failure)
// `accuracy` is optional: see below.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunResult, status, cause, epochs, duration_s, wall_s, estimate,
                                   reference, nees_planar, total, epoch_ms, stages, total_ms,
                                   rejections, noises, warnings, nees, errors, epoch_t_s,
                                   calibration, updates, monitor, pieces)

namespace {

/// Every step-th element, and the last.
class Thinner {
 public:
  explicit Thinner(std::size_t max_points) : max_points_(max_points) {}

  template <class T>
  void keep(std::vector<T>& series) const {
    const std::size_t n = series.size(), step = step_of(n);
    if (step == 1) return;
    std::vector<T> kept;
    for (std::size_t i = 0; i < n; i += step) kept.push_back(std::move(series[i]));
    if ((n - 1) % step != 0) kept.push_back(std::move(series[n - 1]));
    series = std::move(kept);
  }

  /// Each element that is kept is the sum of those since the one before.
  void sum(std::vector<int>& counts) const {
    const std::size_t n = counts.size(), step = step_of(n);
    std::vector<int> kept;
    int since = 0;
    for (std::size_t i = 0; i < n; ++i) {
      since += counts[i];
      if (i % step != 0 && i + 1 != n) continue;
      kept.push_back(since);
      since = 0;
    }
    counts = std::move(kept);
  }

 private:
  std::size_t step_of(std::size_t n) const {
    return std::max<std::size_t>(1, (n + max_points_ - 1) / max_points_);
  }
  std::size_t max_points_;
};

}  // namespace

void thin(MonitorTrack& monitor, std::size_t max_points) {
  const Thinner thinner(max_points);
  thinner.keep(monitor.t_s);
  thinner.keep(monitor.held);
  for (auto& ratios : monitor.sigma_ratio) thinner.keep(ratios);
}

void thin(RunResult& run, std::size_t max_points) {
  const Thinner thinner(max_points);
  thinner.keep(run.estimate);
  thinner.keep(run.reference);
  if (run.accuracy) {
    eval::ErrorSeries& series = run.accuracy->series;
    thinner.keep(series.t_s);
    thinner.keep(series.path_length_m);
    thinner.keep(series.position_error_m);
    thinner.keep(series.yaw_error_deg);
  }
  thinner.keep(run.epoch_ms);
  thinner.keep(run.nees.series);
  thinner.keep(run.errors);
  thinner.keep(run.epoch_t_s);
  for (CalibrationTrack& track : run.calibration) {
    thinner.keep(track.estimate);
    thinner.keep(track.sigma);
  }
  for (UpdateTrack& track : run.updates) {
    thinner.sum(track.applied);
    thinner.sum(track.rejected);
  }
  thin(run.monitor, max_points);
  run.total.J_g_WI = {};
  run.total.P_g.setZero();
  run.total.parity = {};
}

void drop_last_point(RunResult& run) {
  run.estimate.pop_back();
  run.epoch_t_s.pop_back();
  run.epoch_ms.pop_back();
  for (CalibrationTrack& track : run.calibration) {
    track.estimate.pop_back();
    track.sigma.pop_back();
  }
  for (UpdateTrack& track : run.updates) {
    track.total.applied -= track.applied.back();
    track.total.rejected -= track.rejected.back();
    track.applied.pop_back();
    track.rejected.pop_back();
  }
}

nlohmann::json to_record(const RunResult& run) {
  nlohmann::json record = run;
  if (run.accuracy) record["accuracy"] = *run.accuracy;
  return record;
}

RunResult from_record(const nlohmann::json& record) {
  RunResult run = record.get<RunResult>();
  if (record.contains("accuracy")) run.accuracy = record.at("accuracy").get<eval::Accuracy>();
  return run;
}

}  // namespace viwo::experiment
