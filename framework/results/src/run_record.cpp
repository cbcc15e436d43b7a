#include "viwo/results/run_record.hpp"

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

namespace viwo {

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

}  // namespace viwo
