// A run of the filter: feed, record, evaluate.
#include <algorithm>
#include <chrono>
#include <functional>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>

#include <Eigen/Geometry>

#include "filter_start.hpp"
#include "recorder.hpp"
#include "restart.hpp"
#include "running_warnings.hpp"
#include "viwo/feed/feed.hpp"
#include "viwo/math/se2.hpp"
#include "viwo/math/significant.hpp"
#include "viwo/math/stamp.hpp"
#include "viwo/math/time_text.hpp"
#include "viwo/plausibility/plausibility.hpp"
#include "viwo/run/run.hpp"
#include "viwo/run/warnings.hpp"

namespace viwo {
namespace {

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

/// ": no rest (12 of 14 attempts), ...", the most frequent one first.
std::string obstacles_of(const Estimator& estimator) {
  std::vector<StartObstacle> obstacles(estimator.start_obstacles().begin(),
                                       estimator.start_obstacles().end());
  std::ranges::stable_sort(obstacles, std::greater(), &StartObstacle::count);
  std::int64_t attempts = 0;
  for (const StartObstacle& obstacle : obstacles) attempts += obstacle.count;
  std::string text;
  for (const StartObstacle& obstacle : obstacles) {
    text += (text.empty() ? ": " : ", ") + std::string(obstacle.text) + " (" +
            std::to_string(obstacle.count) + " of " + std::to_string(attempts) + " attempts)";
  }
  return text;
}

/// From the first IMU sample to the last, s; 0 where one of them has a stamp of no clock.
double imu_length_s(const RunData& data) {
  const auto imu = data.imu();
  if (imu.empty() || !is_stamp(imu.front().t_ns) || !is_stamp(imu.back().t_ns)) return 0.;
  return seconds_between(imu.front().t_ns, imu.back().t_ns);
}

/// A filter that has found its start in the second half of what there is.
std::string late_start(const RunData& data, const Estimator& estimator, const RunResult& result) {
  constexpr double kPart = 0.5;
  const double log_s = imu_length_s(data);
  if (!(log_s > 0.) || result.pieces.size() != 1) return "";
  const double late_s = seconds_between(data.imu().front().t_ns, result.pieces.front().begin_ns);
  const std::string obstacles = obstacles_of(estimator);
  if (obstacles.empty() || late_s < kPart * log_s) return "";
  return "a state to start from was found only after " + significant(late_s, 3) + " of " +
         significant(log_s, 3) + " s" + obstacles;
}

/// Why a run did not begin: what was in the way of its start, the most frequent first.
std::string no_epoch(const FilterSetup& setup, const Estimator& estimator) {
  if (setup.start.mode == StartMode::kReference || estimator.filter().initialized()) {
    return "the measurements do not make a single epoch";
  }
  std::string text =
      "no state to start from was found in the measurements" + obstacles_of(estimator);
  // A start from motion would have no more to begin with.
  const bool lacks_samples = text.find(": fewer ") != std::string::npos;
  if (setup.start.mode == StartMode::kStandstill) {
    const bool sees_motion = !lacks_samples && (!setup.wheels.empty() || !setup.cameras.empty());
    text += sees_motion ? " - choose start: moving, or reference" : " - choose start: reference";
  } else if (!lacks_samples) {
    text += " (viwo inspect looks for wrong units, axes, clocks and mounts)";
  }
  return text;
}

/// Measured poses of another body on the base become those of the IMU, seen from above.
void refer_to_imu(const RunSetup& setup, Trajectory& reference) {
  if (!setup.extrinsics || !setup.O_in_I) return;
  const Eigen::Vector3d O_in_B = as_se2(*setup.extrinsics), O_in_I = as_se2(*setup.O_in_I);
  const Eigen::Vector3d I_in_B = compose(O_in_B, between(O_in_I, Eigen::Vector3d::Zero()));
  const Eigen::Vector3d p_IinB(I_in_B[1], I_in_B[2], 0.);
  const Eigen::AngleAxisd R_ItoB(I_in_B[0], Eigen::Vector3d::UnitZ());
  for (StampedPose& pose : reference) {
    pose.p_BinW += pose.q_BtoW * p_IinB;
    pose.q_BtoW = pose.q_BtoW * R_ItoB;
  }
}

/// What sensors and filter have refused, named by the sensor.
std::vector<RejectionCount> with_sources(
    const std::vector<std::pair<std::string, RejectionCount>>& rejections) {
  std::vector<RejectionCount> all;
  for (const auto& [source, count] : rejections) {
    all.push_back(count);
    if (source != "estimator") all.back().reason = source + ": " + count.reason;
  }
  return all;
}

/// How a run has ended, and how accurate it was.
void conclude(const RunSetup& setup, const RunData& data, const Estimator& estimator,
              const WheelsWay& wheels_way, RunResult& result) {
  if (!result.epoch_t_s.empty()) result.duration_s = result.epoch_t_s.back();
  const auto lost = std::find_if(result.pieces.begin(), result.pieces.end(),
                                 [](const RunPiece& piece) { return !piece.failure.empty(); });
  if (!result.cause.empty()) {
    result.status = RunStatus::kFailed;
  } else if (!estimator.failure().empty() && result.pieces.size() <= 1) {
    result.status = RunStatus::kDiverged;
    result.cause = estimator.failure() + " (epoch " + std::to_string(result.epochs) + ", " +
                   std::to_string(result.duration_s) + " s)";
  } else if (lost != result.pieces.end()) {
    const double lost_s = seconds_between(result.pieces.front().begin_ns, lost->end_ns);
    result.status = RunStatus::kDiverged;
    result.cause = lost->failure + " (" + std::to_string(lost_s) + " s); started anew, in " +
                   std::to_string(result.pieces.size()) + " pieces";
  } else if (result.epochs == 0) {
    result.status = RunStatus::kFailed;
    result.cause = no_epoch(*setup.filter, estimator);
  }
  if (std::string line = late_start(data, estimator, result); !line.empty()) {
    result.warnings.push_back(std::move(line));
  }
  const std::vector<RejectionCount> rejections = with_sources(result.rejections);
  const std::int64_t begin_ns = result.pieces.empty() ? 0 : result.pieces.front().begin_ns;
  for (std::string& line : refused_altogether(rejections, begin_ns)) {
    result.doubts.push_back(std::move(line));
  }
  for (std::string& line : suspicions(rejections, result.noises, begin_ns)) {
    result.warnings.push_back(std::move(line));
  }
  add_far_from_prior(sigmas_from_prior(*setup.filter, result.calibration), result);
  for (std::string& line : too_sure(result)) {
    result.warnings.push_back(std::move(line));
  }
  if (result.status == RunStatus::kOk && !result.reference.empty()) {
    compare(result.reference, setup, result);
  }
  doubt(result, wheels_way);
}

/// One run, with as many estimators as it takes.
class FilterRun {
 public:
  FilterRun(const RunSetup& setup, const RunData& data, const RunHooks& hooks)
      : setup_(setup),
        data_(data),
        hooks_(hooks),
        live_(data.is_live()),
        warnings_(hooks),
        plausibility_(setup, live_) {
    result_.rejections = data.rejections;
    result_.warnings = setup.warnings;
    result_.live = live_;
    // Made where it stays: those who watch it keep references.
    // NOLINTNEXTLINE(modernize-make-unique)
    estimator_.reset(new Estimator(make_estimator(*setup.filter, live_)));
    start(*estimator_, setup, data);
    if (hooks.on_start) observer_ = hooks.on_start(*estimator_);
    estimator_->observe(observer_);
    recorder_.emplace(setup, data, estimator_->filter(), result_);
    if (restarts()) healthy_.emplace(estimator_->filter());
    feed_ = live_           ? feed_live(setup, data, hooks, plausibility_)
            : data.lockstep ? feed_in_step(setup, data, hooks, plausibility_)
                            : feed_recorded(setup, data, plausibility_);
  }

  RunResult run() {
    const auto begin = Clock::now();
    bool more = true;
    while (more && result_.cause.empty() && !is_interrupted()) {
      more = next(*feed_, *estimator_, result_.cause);
      if (!more) estimator_->finish();
      make_epochs();
      warnings_.say(now_s(), plausibility_.findings());
      if (!estimator_->failure().empty() && !begin_anew(more)) break;
    }
    end_feed();
    recorder_->end_piece(*estimator_, estimator_->failure());
    recorder_->finish(*estimator_);
    // Beside sensors that work while it runs, the filter's own time says little.
    result_.wall_s = data_.streams.empty() && !live_ ? wall_s_ : seconds_since(begin);
    plausibility_.finish();
    add_findings(plausibility_.findings(), result_);
    conclude(setup_, data_, *estimator_, plausibility_.way(), result_);
    return std::move(result_);
  }

 private:
  using Clock = std::chrono::steady_clock;
  /// Who has been started anew this often is not going to do better.
  static constexpr std::size_t kMostPieces = 1000;

  static double seconds_since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
  }

  double now_s() const { return result_.epoch_t_s.empty() ? 0. : result_.epoch_t_s.back(); }

  bool restarts() const {
    const Restart restart = setup_.filter->restart;
    return restart == Restart::kAlways || (restart == Restart::kLive && live_);
  }

  /// A live run is ended by its feed.
  bool is_interrupted() {
    if (live_ || !hooks_.interrupted || !hooks_.interrupted()) return false;
    result_.warnings.push_back("interrupted at " + time_text(to_ns(now_s())) +
                               ": the rest of the recording was not used");
    return true;
  }

  void end_feed() {
    FeedReport report = feed_->finish();
    result_.reference = std::move(report.reference);
    refer_to_imu(setup_, result_.reference);
    if (result_.cause.empty()) result_.cause = std::move(report.cause);
    const auto append = [](auto& to, auto& from) {
      to.insert(to.end(), std::make_move_iterator(from.begin()),
                std::make_move_iterator(from.end()));
    };
    append(result_.stages, report.stages);
    append(result_.rejections, report.rejections);
    append(result_.warnings, report.warnings);
  }

  void make_epochs() {
    while (!feed_->is_over()) {
      const auto begin = Clock::now();
      const bool stepped = step(*estimator_, result_.cause);
      wall_s_ += seconds_since(begin);
      if (!stepped) break;
      // It has failed in this epoch and will say so: there is no state to be kept.
      const ImuState& imu = estimator_->filter().imu();
      if (!imu.p_IinG.allFinite() || !imu.R_GtoI.allFinite()) continue;
      recorder_->record(*estimator_);
      if (healthy_) healthy_->epoch(*estimator_);
      if (result_.epochs == 1) plausibility_.begin_at(result_.pieces.front().begin_ns);
      warnings_.epoch(result_, *estimator_);
      if (live_ || data_.lockstep) {
        const int piece = static_cast<int>(result_.pieces.size()) - 1;
        feed_->on_epoch(*estimator_, piece, warnings_.now(now_s()));
      }
      if (hooks_.on_epoch) hooks_.on_epoch(result_);
      if (hooks_.on_estimate) hooks_.on_estimate(now_s(), estimator_->filter());
      tell_progress();
    }
  }

  void tell_progress() {
    if (!hooks_.progress || live_ || data_.lockstep) return;
    const double log_s = imu_length_s(data_);
    if (!(log_s > 0.)) return;
    const std::int64_t begin_ns = data_.imu().front().t_ns;
    hooks_.progress(seconds_between(begin_ns, estimator_->filter().t_ns()) / log_s);
  }

  /// The estimator has failed. False where the run is to end with that.
  bool begin_anew(bool more) {
    const std::string failure = estimator_->failure();
    if (!healthy_ || !more || result_.pieces.size() >= kMostPieces) return false;
    std::unique_ptr<Estimator> next;
    try {
      const std::optional<FilterSetup> setup = again(*setup_.filter, healthy_->after_failure());
      if (!setup) return false;
      // NOLINTNEXTLINE(modernize-make-unique)
      next.reset(new Estimator(make_estimator(*setup, live_)));
      constexpr std::int64_t kLaterNs = 1'000'000'000;  // than what it has been given already
      start(*next, setup_, data_, estimator_->filter().t_ns() + kLaterNs);
    } catch (const std::exception& error) {
      result_.warnings.push_back(std::string("it could not be started anew: ") + error.what());
      return false;
    }
    warnings_.tell(now_s(), failure + "; starting anew");
    recorder_->end_piece(*estimator_, failure);
    estimator_ = std::move(next);
    estimator_->observe(observer_);
    return true;
  }

  const RunSetup& setup_;
  const RunData& data_;
  const RunHooks& hooks_;
  bool live_;
  RunResult result_;
  std::unique_ptr<Estimator> estimator_;
  EstimatorObserver* observer_ = nullptr;
  std::optional<Recorder> recorder_;
  std::optional<HealthyState> healthy_;  ///< of a run that may start anew
  RunningWarnings warnings_;
  Plausibility plausibility_;  ///< outlives the feed
  std::unique_ptr<Feed> feed_;
  double wall_s_ = 0.;
};

}  // namespace

RunResult run_filter(const RunSetup& setup, const RunData& data, const RunHooks& hooks) {
  return FilterRun(setup, data, hooks).run();
}

}  // namespace viwo
