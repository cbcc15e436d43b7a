// A run of the filter: feed, record, evaluate.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include <Eigen/Dense>

#include "feed.hpp"
#include "monitor_record.hpp"
#include "true_calibration.hpp"
#include "viwo/eval/consistency.hpp"
#include "viwo/experiment/run.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/sim/random.hpp"
#include "viwo/start/moving_start.hpp"
#include "viwo/start/standstill_start.hpp"

namespace viwo::experiment {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// R_GtoI of a reference state.
Matrix3d R_GtoI(const StateSample& state) {
  return to_quaternion(state.q_ItoG_xyzw).normalized().toRotationMatrix().transpose();
}

StampedPose pose_of(const StateSample& state) {
  return {state.t_ns, to_vector(state.p_IinG_m), Eigen::Quaterniond(R_GtoI(state).transpose())};
}

/// Start at the first state of the reference, off by draws from the prior if asked for.
ImuPrior start_from_reference(const FilterSetup& setup, const StateSample& truth,
                              std::uint64_t seed) {
  const StartSetup& start = setup.start;
  sim::RandomStream random(seed, sim::Stream::kStartError);
  ImuPrior prior;
  prior.t_ns = truth.t_ns;
  const auto place = [&](int column, double sigma) {
    Vector3d error;
    for (int i = 0; i < 3; ++i) error[i] = start.state_error_scale * sigma * random.gaussian();
    prior.P.diagonal().segment<3>(column).setConstant(sigma * sigma);
    return error;
  };
  const Vector3d turn = place(kThetaColumn, start.sigma_orientation_rad);
  prior.state.R_GtoI = exp_so3(turn) * R_GtoI(truth);
  prior.state.p_IinG = to_vector(truth.p_IinG_m) - place(kPositionColumn, start.sigma_position_m);
  prior.state.v_IinG =
      to_vector(truth.v_IinG_m_per_s) - place(kVelocityColumn, start.sigma_velocity_m_per_s);
  prior.state.gyro_bias = to_vector(truth.gyro_bias_rad_per_s) -
                          place(kGyroBiasColumn, start.sigma_gyro_bias_rad_per_s);
  prior.state.accel_bias = to_vector(truth.accel_bias_m_per_s2) -
                           place(kAccelBiasColumn, start.sigma_accel_bias_m_per_s2);
  return prior;
}

/// What both ways to start without a reference are told.
template <class Options>
Options start_options(const FilterSetup& setup) {
  Options options;
  options.window_s = setup.start.window_s;
  options.noise = setup.options.filter.imu_noise;
  options.gravity_m_per_s2 = setup.options.filter.gravity_m_per_s2;
  options.sigma_position_m = setup.start.sigma_position_m;
  options.sigma_yaw_rad = setup.start.sigma_orientation_rad;
  options.sigma_gyro_bias_rad_per_s = setup.start.sigma_gyro_bias_rad_per_s;
  options.sigma_accel_bias_m_per_s2 = setup.start.sigma_accel_bias_m_per_s2;
  return options;
}

/// From the motion of the first wheel set.
void start_moving(Estimator& estimator, const FilterSetup& setup) {
  if (setup.wheels.empty()) {
    throw InputError("estimator.start: moving needs wheels - choose standstill or reference");
  }
  auto options = start_options<MovingStartOptions>(setup);
  options.sigma_velocity_m_per_s = setup.start.sigma_velocity_m_per_s;
  options.model = setup.wheels.front().model;
  options.wheels = setup.wheels.front().prior;
  estimator.start([options, wheels = estimator.extra(0)](const StartData& data) {
    return start_from_motion(data.imu, data.samples<EncoderSample>(wheels), options);
  });
}

void start_standing(Estimator& estimator, const FilterSetup& setup) {
  std::vector<StreamId> wheels;
  for (std::size_t i = 0; i < setup.wheels.size(); ++i) wheels.push_back(estimator.extra(i));
  const auto options = start_options<StandstillOptions>(setup);
  estimator.start([options, wheels](const StartData& data) {
    std::vector<std::span<const EncoderSample>> encoders;
    for (const StreamId id : wheels) encoders.push_back(data.samples<EncoderSample>(id));
    return start_from_standstill(data.imu, encoders, options);
  });
}

void start(Estimator& estimator, const RunSetup& run, const RunData& data) {
  const FilterSetup& setup = *run.filter;
  switch (setup.start.mode) {
    case StartMode::kReference:
      if (data.states().empty()) {
        throw InputError(
            "estimator.start: reference needs a sensor that gives reference states; without one "
            "choose start: standstill or moving");
      }
      estimator.start(start_from_reference(setup, data.states().front(), run.seed));
      return;
    case StartMode::kStandstill:
      start_standing(estimator, setup);
      return;
    case StartMode::kMoving:
      start_moving(estimator, setup);
      return;
  }
}

/// Collects what a run reports while it goes on.
class Recorder {
 public:
  Recorder(const RunSetup& setup, const RunData& data, const Filter& filter, RunResult& result)
      : setup_(*setup.filter),
        calibration_(true_calibration(*setup.filter, data.calibration)),
        result_(result) {
    for (const StateSample& state : data.states()) truth_.push_back(pose_of(state));
    for (const BlockSpec& block : filter.blocks().specs()) {
      for (const BlockEntry& entry : block.entries) {
        CalibrationTrack& track = result_.calibration.emplace_back();
        track.name = entry.name;
        track.unit = entry.unit;
      }
    }
  }

  void record(const Estimator& estimator) {
    const Filter& filter = estimator.filter();
    const ImuView& imu = filter.imu();
    if (result_.estimate.empty()) begin_ns_ = filter.t_ns();
    const double t_s = seconds_between(begin_ns_, filter.t_ns());
    result_.estimate.push_back(
        {filter.t_ns(), imu.p_IinG, Eigen::Quaterniond(imu.R_GtoI.transpose())});
    result_.epoch_t_s.push_back(t_s);
    add_error(filter, t_s);
    add_calibration(filter);
    add_counts(estimator);
    record_monitors(estimator, t_s, result_.monitor);
    const auto stages = estimator.stage_ms();
    stage_ms_.resize(stages.size());
    for (std::size_t i = 0; i < stages.size(); ++i) stage_ms_[i].push_back(stages[i]);
    result_.epoch_ms.emplace_back(t_s, std::accumulate(stages.begin(), stages.end(), 0.));
  }

  void finish(const Estimator& estimator) {
    const auto names = estimator.stage_names();
    for (std::size_t i = 0; i < stage_ms_.size(); ++i) {
      result_.stages.emplace_back(names[i], stage_time(stage_ms_[i]));
    }
    std::vector<double> total;
    for (const auto& [t_s, ms] : result_.epoch_ms) total.push_back(ms);
    result_.total_ms = stage_time(total);
    for (const RejectionCount& rejection : estimator.rejections()) {
      result_.rejections.emplace_back("estimator", rejection);
    }
    if (n_nees_ > 0) {
      result_.nees.pose = sum_pose_ / n_nees_;
      result_.nees.position = sum_position_ / n_nees_;
      result_.nees.orientation = sum_orientation_ / n_nees_;
    }
    if (!truth_.empty()) result_.reference = truth_;
  }

 private:
  /// (F-11).
  void add_error(const Filter& filter, double t_s) {
    // Only then is G that of the reference: else the two poses are not in one frame.
    if (setup_.start.mode != StartMode::kReference) return;
    const auto truth = interpolate(truth_, filter.t_ns(), 0.2);
    if (!truth) return;
    const ImuView& imu = filter.imu();
    Eigen::Matrix<double, 6, 1> error;
    error.head<3>() =
        -log_so3(truth->q_BtoW.toRotationMatrix().transpose() * imu.R_GtoI.transpose());
    error.tail<3>() = truth->p_BinW - imu.p_IinG;
    const auto& P = filter.covariance();
    const Vector3d up_in_I = imu.R_GtoI.col(2);
    PoseError sample;
    sample.t_s = t_s;
    sample.position_m = -error.tail<3>();
    sample.position_sigma_m = P.diagonal().segment<3>(3).cwiseSqrt();
    // R_GtoI = Exp(-dtheta) R_GtoI_hat: the true body is turned by dtheta further, in I.
    sample.yaw_rad = -up_in_I.dot(error.head<3>());
    sample.yaw_sigma_rad = std::sqrt(up_in_I.dot(P.topLeftCorner<3, 3>() * up_in_I));
    result_.errors.push_back(sample);
    const double pose = eval::nees(error, P.topLeftCorner<6, 6>());
    if (!std::isfinite(pose)) return;
    sum_pose_ += pose;
    sum_orientation_ += eval::nees(error.head<3>(), P.topLeftCorner<3, 3>());
    sum_position_ += eval::nees(error.tail<3>(), P.block<3, 3>(3, 3));
    ++n_nees_;
    result_.nees.series.emplace_back(t_s, pose);
  }

  void add_counts(const Estimator& estimator) {
    if (result_.updates.empty()) {
      for (const UpdateEntry& entry : estimator.updates()) {
        result_.updates.push_back({entry.name, {}, {}, {}, {}});
      }
    }
    for (std::size_t i = 0; i < result_.updates.size(); ++i) {
      UpdateTrack& track = result_.updates[i];
      const UpdateCounts& total = estimator.counts()[i];
      track.applied.push_back(static_cast<int>(total.applied - track.total.applied));
      track.rejected.push_back(static_cast<int>(total.rejected - track.total.rejected));
      track.total = total;
      track.failures = estimator.failures()[i];
    }
  }

  void add_calibration(const Filter& filter) {
    auto track = result_.calibration.begin();
    for (const BlockEstimate& estimate : calibration_of(filter)) {
      track->estimate.push_back(estimate.value);
      track->sigma.push_back(estimate.sigma);
      ++track;
    }
    compare_calibration(calibration_, filter, result_.calibration);
  }

  const FilterSetup& setup_;
  std::map<std::string, double> calibration_;  ///< true values
  RunResult& result_;
  Trajectory truth_;
  std::int64_t begin_ns_ = 0;
  std::vector<std::vector<double>> stage_ms_;
  double sum_pose_ = 0., sum_position_ = 0., sum_orientation_ = 0.;
  int n_nees_ = 0;
};

/// Feed::next(); once there are results, a sensor that breaks is the cause of a run that failed.
bool next(Feed& feed, Estimator& estimator, std::string& cause) {
  try {
    return feed.next(estimator);
  } catch (const std::exception& error) {
    if (estimator.epochs() == 0) throw;
    cause = error.what();
    return false;
  }
}

/// Estimator::step(); what a kinematic model throws becomes the cause of a run that failed.
bool step(Estimator& estimator, std::string& cause) {
  try {
    return estimator.step();
  } catch (const PluginFailure& failure) {
    cause = std::string(failure.what()) + " (epoch " + std::to_string(estimator.epochs() + 1) + ")";
    return false;
  }
}

/// Why a run did not begin: what was in the way of its start, the most frequent first.
std::string no_epoch(const FilterSetup& setup, const Estimator& estimator) {
  if (setup.start.mode == StartMode::kReference || estimator.filter().initialized()) {
    return "the measurements do not make a single epoch";
  }
  std::vector<StartObstacle> obstacles(estimator.start_obstacles().begin(),
                                       estimator.start_obstacles().end());
  std::stable_sort(obstacles.begin(), obstacles.end(),
                   [](const auto& a, const auto& b) { return a.count > b.count; });
  std::int64_t attempts = 0;
  for (const StartObstacle& obstacle : obstacles) attempts += obstacle.count;
  std::string text = "no state to start from was found in the measurements";
  const char* separator = ": ";
  for (const StartObstacle& obstacle : obstacles) {
    text += separator + std::string(obstacle.text) + " (" + std::to_string(obstacle.count) +
            " of " + std::to_string(attempts) + " attempts)";
    separator = ", ";
  }
  if (setup.start.mode == StartMode::kStandstill) {
    text += setup.wheels.empty() ? " - choose start: reference"
                                 : " - choose start: moving, or reference";
  }
  return text;
}

/// How a run has ended, and how accurate it was.
void conclude(const RunSetup& setup, const Estimator& estimator, RunResult& result) {
  result.epochs = estimator.epochs();
  if (!result.estimate.empty()) {
    result.duration_s = seconds_between(result.estimate.front().t_ns, result.estimate.back().t_ns);
  }
  if (!result.cause.empty()) {
    result.status = RunStatus::kFailed;
  } else if (!estimator.failure().empty()) {
    result.status = RunStatus::kDiverged;
    result.cause = estimator.failure() + " (epoch " + std::to_string(result.epochs) + ", " +
                   std::to_string(result.duration_s) + " s)";
  } else if (result.epochs == 0) {
    result.status = RunStatus::kFailed;
    result.cause = no_epoch(*setup.filter, estimator);
  }
  if (const Contact& contact = estimator.contact(); contact.loosened() > 0) {
    result.warnings.push_back("all updates contradicted the estimate, first at " +
                              stamp_text(contact.first_ns()) + "; it was loosened " +
                              std::to_string(contact.loosened()) +
                              " times - look for faults of the IMU there");
  }
  for (std::string& line : contradictions(result.updates)) {
    result.warnings.push_back(std::move(line));
  }
  if (result.status == RunStatus::kOk && !result.reference.empty()) {
    result.accuracy = eval::evaluate(result.reference, result.estimate, setup.evaluation);
  }
}

}  // namespace

RunResult run_filter(const RunSetup& setup, const RunData& data, const RunHooks& hooks) {
  RunResult result;
  result.rejections = data.rejections;
  result.warnings = setup.warnings;
  const bool live = !data.live.empty();
  result.live = live;
  Estimator estimator = make_estimator(*setup.filter, live);
  start(estimator, setup, data);
  if (hooks.on_start) estimator.observe(hooks.on_start(estimator));
  Recorder recorder(setup, data, estimator.filter(), result);
  const auto feed = live ? feed_live(setup, data, hooks) : feed_recorded(setup, data);
  const auto imu = data.imu();
  const double log_s = live ? 0. : seconds_between(imu.front().t_ns, imu.back().t_ns);
  double wall_s = 0.;
  const auto all_begin = std::chrono::steady_clock::now();
  bool more = true;
  while (more && estimator.failure().empty() && result.cause.empty()) {
    more = next(*feed, estimator, result.cause);
    if (!more) estimator.finish();
    for (;;) {
      const auto begin = std::chrono::steady_clock::now();
      const bool stepped = step(estimator, result.cause);
      wall_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      if (!stepped) break;
      recorder.record(estimator);
      feed->on_epoch(estimator);
      if (hooks.on_epoch) hooks.on_epoch(result);
      if (hooks.progress && log_s > 0.) {
        hooks.progress(seconds_between(imu.front().t_ns, estimator.filter().t_ns()) / log_s);
      }
    }
  }
  feed->finish(result);
  recorder.finish(estimator);
  // Beside sensors that work while it runs, the filter's own time says little.
  const std::chrono::duration<double> all_s = std::chrono::steady_clock::now() - all_begin;
  result.wall_s = data.streams.empty() && !live ? wall_s : all_s.count();
  conclude(setup, estimator, result);
  return result;
}

}  // namespace viwo::experiment
