#include "viwo/results/run_record.hpp"

#include <algorithm>
#include <optional>
#include <stdexcept>

// What is kept of each type, in both directions: all of its members, in their order. A member that
// is missing here does not compile, for the names are also those of a binding to all there are.
#define VIWO_RECORD(Type, ...)                                    \
  [[maybe_unused]] static void every_member_of(const Type& all) { \
    [[maybe_unused]] const auto& [__VA_ARGS__] = all;             \
  }                                                               \
  NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Type, __VA_ARGS__)

namespace nlohmann {

template <class T>
struct adl_serializer<std::optional<T>> {
  static void to_json(json& out, const std::optional<T>& value) {
    out = value ? json(*value) : json();
  }
  static void from_json(const json& in, std::optional<T>& value) {
    value = in.is_null() ? std::nullopt : std::optional<T>(in.get<T>());
  }
};

template <>
struct adl_serializer<Eigen::Vector3d> {
  static void to_json(json& out, const Eigen::Vector3d& v) { out = {v.x(), v.y(), v.z()}; }
  static void from_json(const json& in, Eigen::Vector3d& v) {
    for (std::size_t i = 0; i < 3; ++i) v[static_cast<Eigen::Index>(i)] = in.at(i).get<double>();
  }
};

}  // namespace nlohmann

namespace viwo {

VIWO_RECORD(RejectionCount, reason, count, first, of)
VIWO_RECORD(NoiseFound, name, unit, configured, found, count)
VIWO_RECORD(UpdateCounts, applied, rejected)
VIWO_RECORD(UpdateFailures, count, disabled, cause)
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

VIWO_RECORD(SegmentErrors, length_m, count, mean_m, rmse_m, mean_deg, rmse_deg)
VIWO_RECORD(ErrorSeries, t_s, path_length_m, position_error_m, yaw_error_deg)
VIWO_RECORD(Accuracy, alignment, n_poses, n_outside, n_in_gap, duration_s, path_length_m, ate_m,
            ate_deg, rpe, end_m, end_deg, end_yaw_deg, series)

}  // namespace viwo::eval

namespace viwo {

VIWO_RECORD(StageTime, mean_ms, p95_ms, p99_ms, max_ms)
VIWO_RECORD(CalibrationTrack, name, unit, estimate, sigma, truth, final_error, scatter)
VIWO_RECORD(PoseNees, pose, position, orientation, relative, series)
VIWO_RECORD(EndSigma, position_m, yaw_rad, grown_m)
VIWO_RECORD(PoseError, t_s, position_m, position_sigma_m, yaw_rad, yaw_sigma_rad)
VIWO_RECORD(UpdateTrack, name, total, failures, applied, rejected)
VIWO_RECORD(MonitorWarning, t_s, text, parameters)
VIWO_RECORD(MonitorTrack, t_s, parameters, sigma_ratio, held, warnings)
VIWO_RECORD(RunPiece, begin_ns, end_ns, epochs, failure)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RunResult, status, cause, epochs, duration_s, wall_s, estimate,
                                   reference, accuracy, nees_planar, total, epoch_ms, stages,
                                   total_ms, rejections, noises, warnings, doubts, nees, end_sigma,
                                   errors, epoch_t_s, calibration, updates, monitor, pieces)
// As above, with what is only of a run that is going on (live, on_disk), or for its own page and
// files (pictures, final_calibration).
[[maybe_unused]] static void every_member_of(const RunResult& all) {
  [[maybe_unused]] const auto& [status, cause, epochs, duration_s, wall_s, live, estimate,
                                reference, accuracy, nees_planar, total, epoch_ms, stages, total_ms,
                                rejections, noises, warnings, doubts, nees, end_sigma, errors,
                                epoch_t_s, calibration, final_calibration, updates, monitor, pieces,
                                on_disk, pictures] = all;
}

nlohmann::json to_record(const RunResult& run) { return run; }

namespace {

bool is_well_formed(const Trajectory& poses) {
  const auto is_later = [](const StampedPose& a, const StampedPose& b) { return b.t_ns <= a.t_ns; };
  return std::adjacent_find(poses.begin(), poses.end(), is_later) == poses.end() &&
         std::all_of(poses.begin(), poses.end(), [](const StampedPose& pose) {
           return pose.p_BinW.allFinite() && pose.q_BtoW.coeffs().allFinite();
         });
}

bool is_well_formed(const eval::Accuracy& accuracy) {
  const eval::ErrorSeries& series = accuracy.series;
  const std::size_t n = series.t_s.size();
  return accuracy.alignment >= eval::Alignment::kNone &&
         accuracy.alignment <= eval::Alignment::kSe3 && series.path_length_m.size() == n &&
         series.position_error_m.size() == n && series.yaw_error_deg.size() == n &&
         std::min({accuracy.n_poses, accuracy.n_outside, accuracy.n_in_gap}) >= 0;
}

bool is_well_formed(const MonitorTrack& monitor) {
  const std::size_t n = monitor.t_s.size();
  return monitor.held.size() == n && monitor.sigma_ratio.size() == monitor.parameters.size() &&
         std::all_of(monitor.sigma_ratio.begin(), monitor.sigma_ratio.end(),
                     [&](const auto& ratios) { return ratios.empty() || ratios.size() == n; });
}

bool is_well_formed(const RunResult& run) {
  const std::size_t n = run.epoch_t_s.size();
  return run.status >= RunStatus::kOk && run.status <= RunStatus::kFailed && run.epochs >= 0 &&
         is_well_formed(run.estimate) && is_well_formed(run.reference) &&
         (!run.accuracy || is_well_formed(*run.accuracy)) && is_well_formed(run.monitor) &&
         std::is_sorted(run.epoch_t_s.begin(), run.epoch_t_s.end()) &&
         std::all_of(run.calibration.begin(), run.calibration.end(),
                     [&](const CalibrationTrack& track) {
                       return track.estimate.size() == n && track.sigma.size() == n;
                     }) &&
         std::all_of(run.updates.begin(), run.updates.end(), [&](const UpdateTrack& track) {
           return track.applied.size() == n && track.rejected.size() == n &&
                  std::min(track.total.applied, track.total.rejected) >= 0;
         });
}

}  // namespace

RunResult from_record(const nlohmann::json& record) {
  auto run = record.get<RunResult>();
  // A number that its member cannot hold has become another one by now.
  if (nlohmann::json::to_cbor(to_record(run)) != nlohmann::json::to_cbor(record) ||
      !is_well_formed(run)) {
    throw std::invalid_argument("this is not the record of a run");
  }
  return run;
}

}  // namespace viwo
