#include "recorder.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <Eigen/Dense>

#include "filter_start.hpp"
#include "monitor_record.hpp"
#include "true_calibration.hpp"
#include "viwo/eval/consistency.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/math/time_text.hpp"
#include "viwo/run/calibration_track.hpp"
#include "viwo/run/thin.hpp"
#include "viwo/setup/calibration_values.hpp"

namespace viwo {
namespace {

/// Points of each series that a live run keeps: this, to twice as many.
constexpr std::size_t kLivePoints = 4096;

double yaw_sigma_rad(const ImuState& imu, const ImuMatrix& P) {
  const Eigen::Vector3d up_in_I = imu.R_GtoI.col(2);
  return std::sqrt(up_in_I.dot(P.topLeftCorner<3, 3>() * up_in_I));
}

}  // namespace

Recorder::Recorder(const RunSetup& setup, const RunData& data, const Filter& filter,
                   RunResult& result)
    : setup_(*setup.filter),
      calibration_(true_calibration(*setup.filter, data.calibration)),
      result_(result),
      is_live_(result.live),
      scatter_(filter.blocks()) {
  for (const StateSample& state : data.states()) {
    truth_.push_back(
        {state.t_ns, to_vector(state.p_IinG_m), Eigen::Quaterniond(R_GtoI(state).transpose())});
  }
  for (const BlockSpec& block : filter.blocks().specs()) {
    for (const BlockEntry& entry : block.entries) {
      CalibrationTrack& track = result_.calibration.emplace_back();
      track.name = entry.name;
      track.unit = entry.unit;
    }
  }
}

void Recorder::record(const Estimator& estimator) {
  const Filter& filter = estimator.filter();
  const ImuState& imu = filter.imu();
  const std::int64_t t_ns = filter.t_ns();
  if (is_live_) bound_series();
  if (result_.epochs == 0) begin_ns_ = last_ns_ = t_ns;
  add_piece(t_ns);
  last_ns_ = t_ns;
  ++result_.epochs;
  const double t_s = seconds_between(begin_ns_, t_ns);
  result_.estimate.push_back({t_ns, imu.p_IinG, Eigen::Quaterniond(imu.R_GtoI.transpose())});
  result_.epoch_t_s.push_back(t_s);
  add_error(filter, t_s);
  add_end_sigma(filter);
  add_calibration(filter);
  add_counts(estimator);
  record_monitors(estimator, t_s, result_.monitor);
  const auto stages = estimator.stage_ms();
  stage_ms_.resize(stages.size());
  for (std::size_t i = 0; i < stages.size(); ++i) stage_ms_[i].add(stages[i]);
  const double total_ms = std::accumulate(stages.begin(), stages.end(), 0.);
  total_ms_.add(total_ms);
  result_.epoch_ms.emplace_back(t_s, total_ms);
}

/// Makes room for another point.
void Recorder::bound_series() {
  if ((result_.epochs - 1) % stride_ != 0) drop_last_point(result_);
  if (result_.epoch_t_s.size() > 2 * kLivePoints) {
    thin(result_, kLivePoints + 1);  // every second one of an odd number: the last one, too
    stride_ *= 2;
  }
  if (result_.monitor.t_s.size() > 2 * kLivePoints) thin(result_.monitor, kLivePoints);
}

void Recorder::add_piece(std::int64_t t_ns) {
  if (!std::exchange(in_piece_, true)) {
    // A clock that was set back: the time of the run goes on.
    if (t_ns < last_ns_) begin_ns_ += t_ns - last_ns_;
    result_.pieces.push_back({t_ns, t_ns, 0, ""});
    start_m2_.reset();
  }
  result_.pieces.back().end_ns = t_ns;
  ++result_.pieces.back().epochs;
}

void Recorder::end_piece(const Estimator& estimator, const std::string& failure) {
  scatter_.begin_anew();
  if (std::exchange(in_piece_, false)) {
    result_.pieces.back().failure = failure;
  } else if (!failure.empty()) {
    result_.warnings.push_back(failure + ", before there was a state to start from");
  }
  ended_.clear();
  for (const UpdateTrack& update : result_.updates) {
    ended_.push_back({update.name, update.total, {}, {}, update.failures});
  }
  for (const RejectionCount& part : estimator.rejections()) rejections_.add(part);
  const Contact& contact = estimator.contact();
  if (contact.loosened() > 0 && loosened_ == 0) first_loosened_ns_ = contact.first_ns();
  loosened_ += contact.loosened();
}

void Recorder::finish(const Estimator& estimator) {
  const auto names = estimator.stage_names();
  for (std::size_t i = 0; i < stage_ms_.size(); ++i) {
    result_.stages.emplace_back(names[i], stage_ms_[i].stage());
  }
  result_.total_ms = total_ms_.stage();
  for (const RejectionCount& rejection : rejections_.counts()) {
    result_.rejections.emplace_back("estimator", rejection);
  }
  result_.noises = estimator.noises();
  result_.final_calibration = calibration_file_of(estimator.filter());
  widen(*result_.final_calibration, result_.calibration);
  if (loosened_ > 0) {
    std::string updates;
    for (const UpdateTrack& update : result_.updates) {
      if (update.total.applied + update.total.rejected == 0) continue;
      updates += (updates.empty() ? "" : ", ") + update.name;
    }
    constexpr int kOften = 3;  // what comes back to where it was does not again and again
    auto& lines = loosened_ < kOften ? result_.warnings : result_.doubts;
    lines.push_back("all updates contradicted the estimate, first at " +
                    time_text(first_loosened_ns_ - begin_ns_) + "; it was loosened " +
                    std::to_string(loosened_) +
                    " times - look for faults of the IMU there, or of all that is "
                    "measured by " +
                    updates);
  }
  if (n_nees_ > 0) {
    result_.nees.pose = sum_pose_ / n_nees_;
    result_.nees.position = sum_position_ / n_nees_;
    result_.nees.orientation = sum_orientation_ / n_nees_;
  }
  if (n_relative_ > 0) result_.nees.relative = sum_relative_ / n_relative_;
  if (!truth_.empty()) result_.reference = truth_;
}

/// (F-11).
void Recorder::add_error(const Filter& filter, double t_s) {
  // Only then is G that of the reference: else the two poses are not in one frame.
  if (setup_.start.mode != StartMode::kReference) return;
  const auto truth = interpolate(truth_, filter.t_ns(), 0.2);
  if (!truth) return;
  const ImuState& imu = filter.imu();
  Eigen::Matrix<double, 6, 1> error;
  error.head<3>() = -log_so3(truth->q_BtoW.toRotationMatrix().transpose() * imu.R_GtoI.transpose());
  error.tail<3>() = truth->p_BinW - imu.p_IinG;
  const ImuMatrix P = filter.imu_covariance();
  PoseError sample;
  sample.t_s = t_s;
  sample.position_m = -error.tail<3>();
  sample.position_sigma_m = P.diagonal().segment<3>(3).cwiseSqrt();
  // R_GtoI = Exp(-dtheta) R_GtoI_hat: the true body is turned by dtheta further, in I.
  sample.yaw_rad = -imu.R_GtoI.col(2).dot(error.head<3>());
  sample.yaw_sigma_rad = yaw_sigma_rad(imu, P);
  result_.errors.push_back(sample);
  add_relative_error(filter, *truth);
  const double pose = eval::nees(error, P.topLeftCorner<6, 6>());
  if (!std::isfinite(pose)) return;
  sum_pose_ += pose;
  sum_orientation_ += eval::nees(error.head<3>(), P.topLeftCorner<3, 3>());
  sum_position_ += eval::nees(error.tail<3>(), P.block<3, 3>(3, 3));
  ++n_nees_;
  result_.nees.series.emplace_back(t_s, pose);
}

void Recorder::add_end_sigma(const Filter& filter) {
  const ImuMatrix P = filter.imu_covariance();
  const double m2 = P.diagonal().segment<3>(kPositionColumn).sum();
  if (!start_m2_) start_m2_ = m2;
  result_.end_sigma = {std::sqrt(m2), yaw_sigma_rad(filter.imu(), P),
                       std::sqrt(std::max(0., m2 - *start_m2_))};
}

/// From the oldest clone to now (F-40).
void Recorder::add_relative_error(const Filter& filter, const StampedPose& truth) {
  const CloneState& from = filter.clones().front();
  const auto true_from = interpolate(truth_, from.t_ns, 0.2);
  if (!true_from || from.t_ns >= filter.t_ns()) return;
  const auto R_GtoI = [](const StampedPose& pose) -> Eigen::Matrix3d {
    return pose.q_BtoW.toRotationMatrix().transpose();
  };
  const ImuState& to = filter.imu();
  const auto& P = filter.covariance();
  Eigen::Matrix<double, 12, 12> both;
  both << P.topLeftCorner<6, 6>(), P.block<6, 6>(0, from.column), P.block<6, 6>(from.column, 0),
      P.block<6, 6>(from.column, from.column);
  const double relative =
      eval::relative_nees({from.R_GtoI, R_GtoI(*true_from), from.p_IinG, true_from->p_BinW},
                          {to.R_GtoI, R_GtoI(truth), to.p_IinG, truth.p_BinW}, both);
  if (!std::isfinite(relative)) return;
  sum_relative_ += relative;
  ++n_relative_;
}

void Recorder::add_counts(const Estimator& estimator) {
  if (result_.updates.empty()) {
    for (const UpdateEntry& entry : estimator.updates()) {
      result_.updates.push_back({entry.name, {}, {}, {}, {}});
    }
  }
  for (std::size_t i = 0; i < result_.updates.size(); ++i) {
    UpdateTrack& track = result_.updates[i];
    UpdateCounts total = estimator.counts()[i];
    UpdateFailures failures = estimator.failures()[i];
    if (!ended_.empty()) {
      total.applied += ended_[i].total.applied;
      total.rejected += ended_[i].total.rejected;
      failures.count += ended_[i].failures.count;
      failures.disabled = failures.disabled || ended_[i].failures.disabled;
      if (!ended_[i].failures.cause.empty()) failures.cause = ended_[i].failures.cause;
    }
    track.applied.push_back(static_cast<int>(total.applied - track.total.applied));
    track.rejected.push_back(static_cast<int>(total.rejected - track.total.rejected));
    track.total = total;
    track.failures = std::move(failures);
  }
}

void Recorder::add_calibration(const Filter& filter) {
  auto track = result_.calibration.begin();
  for (const BlockEstimate& estimate : calibration_of(filter)) {
    track->estimate.push_back(estimate.value);
    track->sigma.push_back(estimate.sigma);
    ++track;
  }
  compare_calibration(calibration_, filter, result_.calibration);
  if (!scatter_.epoch(filter)) return;
  const std::vector<double> factors = scatter_.factors();
  for (std::size_t i = 0; i < factors.size(); ++i) result_.calibration[i].scatter = factors[i];
}

}  // namespace viwo
