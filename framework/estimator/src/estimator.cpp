#include "viwo/estimator/estimator.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <stdexcept>
#include <utility>

#include <Eigen/Geometry>

#include "viwo/filter/health.hpp"
#include "viwo/math/arrays.hpp"
#include "viwo/math/so3.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo {
namespace {

constexpr std::size_t kFirstWindow = 3;
constexpr std::size_t kEpochsPerClone = 3;
/// Over which the filter goes on without the IMU. Whoever is silent for longer, or begins to speak
/// so long after the start, leaves nothing that an estimate could be made of, epoch after epoch.
constexpr double kLongestSilenceS = 60.;
/// Nor does who says next to nothing, however often: of silences longer than a second.
constexpr double kLongSilencesS = 300., kMostlyS = 0.9;
/// A failure soon after a silence of the IMU that was bridged is most likely its consequence.
constexpr double kSilenceToNameS = 1., kSoonAfterS = 10.;

/// CPU time of this thread: what an epoch costs, however busy the machine is with other things.
double thread_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// Times the stages of an epoch, one after the other.
class StageClock {
 public:
  explicit StageClock(std::span<double> stage_ms) : stage_ms_(stage_ms) {}
  void done() {
    const double now_ms = thread_ms();
    stage_ms_[stage_++] = now_ms - begin_ms_;
    begin_ms_ = now_ms;
  }

 private:
  std::span<double> stage_ms_;
  std::size_t stage_ = 0;
  double begin_ms_ = thread_ms();
};

DeclarationTable declare_all(std::span<const UpdateEntry> updates,
                             const std::vector<ExtraStream>& extra) {
  DeclarationTable declared;
  for (const UpdateEntry& entry : updates) {
    try {
      declared.declare(entry);
    } catch (const InputError&) {
      throw;
    } catch (const std::exception& error) {
      throw UpdateFailure(entry.name, error.what());
    } catch (...) {
      throw UpdateFailure(entry.name, "threw something that is not a std::exception");
    }
  }
  for (const ExtraStream& stream : extra) declared.add_stream(stream.spec, stream.taker);
  declared.finish();
  return declared;
}

std::vector<BlockSpec> continued(std::vector<BlockSpec> blocks, const Continuation& before) {
  for (BlockSpec& block : blocks) {
    for (const auto& [name, value] : before.blocks) {
      if (name == block.name && value.size() == block.value.size()) block.value = value;
    }
  }
  return blocks;
}

}  // namespace

ImuPrior moved_to(const Continuation::Place& place, ImuPrior prior) {
  // The turn that makes the trace of R R_ItoG(prior) R_GtoI(place) largest.
  const Eigen::Matrix3d M = prior.state.R_GtoI.transpose() * place.R_GtoI;
  const double turn = std::atan2(M(0, 1) - M(1, 0), M(0, 0) + M(1, 1));
  const Eigen::Matrix3d R = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  prior.state.R_GtoI = prior.state.R_GtoI * R.transpose();
  prior.state.p_IinG = place.p_IinG + R * prior.state.p_IinG;
  prior.state.v_IinG = R * prior.state.v_IinG;
  ImuMatrix turned = ImuMatrix::Identity();
  turned.block<3, 3>(kPositionColumn, kPositionColumn) = R;
  turned.block<3, 3>(kVelocityColumn, kVelocityColumn) = R;
  prior.P = turned * prior.P * turned.transpose();
  const double gone_m = place.speed_m_per_s * std::max(0., seconds_between(place.t_ns, prior.t_ns));
  prior.P.diagonal().segment<3>(kPositionColumn).array() += gone_m * gone_m;
  return prior;
}

Estimator::Estimator(const EstimatorOptions& options, std::vector<UpdateEntry> updates,
                     const std::vector<ExtraStream>& extra)
    : Estimator(options, updates, extra.size(), declare_all(updates, extra)) {}

Estimator::Estimator(const EstimatorOptions& options, std::vector<UpdateEntry> updates,
                     std::size_t n_extra, DeclarationTable declared)
    : options_(options),
      declared_(std::move(declared)),
      filter_(options.filter, continued(declared_.blocks(), options.continuation),
              declared_.rooms()),
      runner_(options.runner, std::move(updates), declared_, filter_),
      first_extra_(declared_.taken().size() - n_extra),
      intake_(declared_, options.imu),
      stage_ms_(runner_.updates().size() + 2, 0.) {
  if (!options.monitor.enabled) return;
  for (const BlockGroup& group : filter_.blocks().groups()) {
    ExcitationMonitor monitor(options.monitor, filter_.blocks(), group);
    if (!monitor.parameters().empty()) monitors_.push_back(std::move(monitor));
  }
}

std::vector<RejectionCount> Estimator::rejections() const {
  std::vector<RejectionCount> all = intake_.rejections().counts();
  runner_.rejections(all);
  return all;
}

std::vector<NoiseFound> Estimator::noises() const {
  std::vector<NoiseFound> all;
  runner_.noises(all);
  return all;
}

std::vector<std::string> Estimator::stage_names() const {
  std::vector<std::string> names{"propagate"};
  for (const UpdateEntry& entry : updates()) names.push_back(entry.name);
  names.emplace_back("marginalise");
  return names;
}

void Estimator::start(const ImuPrior& prior) {
  start_ns_ = prior.t_ns;
  filter_.initialize(prior);
  if (runner_.observer() != nullptr) runner_.observer()->on_start(filter_, prior);
  intake_.start_at(prior.t_ns, filter_.blocks());
}

bool Estimator::find_start() {
  const auto prior = intake_.find_start(search_, filter_.blocks());
  if (!prior) return false;
  const auto& place = options_.continuation.place;
  start(place ? moved_to(*place, *prior) : *prior);
  return true;
}

bool Estimator::step() {
  if (!failure_.empty()) return false;
  if (intake_.set_back_s() > 0.) {
    failure_ =
        "the clock of the IMU was set back by " + std::to_string(intake_.set_back_s()) + " s";
    return false;
  }
  if (!filter_.initialized() && !find_start()) return false;
  if (listen(); !failure_.empty()) return false;
  const auto t_ns = intake_.next_epoch_ns(options_.schedule, filter_.t_ns(), filter_.blocks());
  if (!t_ns) return false;
  StageClock clock(stage_ms_);
  const EpochData data = intake_.take(filter_.t_ns(), *t_ns, filter_.blocks());
  propagate(data);
  clock.done();
  for (std::size_t i = 0; i < updates().size(); ++i) {
    runner_.run(i, data, filter_, monitors_);
    clock.done();
  }
  watch(data);
  if (filter_.window_full()) filter_.drop_oldest_clone();
  const auto clones = filter_.clones();
  intake_.forget(filter_.t_ns(), clones.empty() ? filter_.t_ns() : clones.front().t_ns,
                 filter_.blocks());
  failure_ = failure_of(filter_, options_.health);
  if (failure_.empty()) failure_ = contact_.epoch(runner_.counts(), filter_);
  if (!failure_.empty()) failure_ += cause_of_failure();
  ++epochs_;
  clock.done();
  return true;
}

void Estimator::listen() {
  const double silent_s = intake_.silent_s(filter_.t_ns());
  if (silent_s > kLongestSilenceS) {
    failure_ = "the IMU was silent for " + std::to_string(silent_s) + " s";
    return;
  }
  if (silent_s <= kSilenceToNameS || filter_.t_ns() < silence_.end_ns) return;
  silence_ = {silent_s, filter_.t_ns() + to_ns(silent_s), silence_.in_all_s + silent_s};
  const double since_start_s = seconds_between(start_ns_, silence_.end_ns);
  if (silence_.in_all_s < kLongSilencesS || silence_.in_all_s < kMostlyS * since_start_s) return;
  failure_ = "the IMU was silent for " + std::to_string(silence_.in_all_s) + " s of " +
             std::to_string(since_start_s) + " s";
}

std::string Estimator::cause_of_failure() const {
  const bool soon =
      silence_.duration_s > 0. && seconds_between(silence_.end_ns, filter_.t_ns()) < kSoonAfterS;
  if (!soon) return "";
  return ": the IMU had been silent for " + std::to_string(silence_.duration_s) + " s";
}

void Estimator::propagate(const EpochData& data) {
  if (options_.growing_window) {
    filter_.limit_window(kFirstWindow + static_cast<std::size_t>(epochs_) / kEpochsPerClone);
  }
  const ImuTransition transition = filter_.propagate(data.imu, intake_.gaps_s());
  if (runner_.observer() != nullptr) runner_.observer()->on_propagated(filter_, transition);
  if (options_.along != nullptr) follow(*options_.along, data.imu.back());
  filter_.clone(data.imu.back());
  if (runner_.observer() != nullptr) runner_.observer()->on_clone(filter_, transition.Phi);
}

/// The estimate becomes the given one of this epoch, whose clocks may have been others.
void Estimator::follow(const GivenPath& path, const ImuSample& sample) {
  const auto k = static_cast<std::size_t>(epochs_);
  if (k >= path.epochs.size()) {
    throw std::out_of_range("there are more epochs than the given path has");
  }
  ImuState state = path.epochs[k].state;
  const double dt_s = seconds_between(path.epochs[k].t_ns, filter_.t_ns());
  state.p_IinG += dt_s * state.v_IinG;
  state.R_GtoI =
      exp_so3(-dt_s * (to_vector(sample.gyro_rad_per_s) - state.gyro_bias)) * state.R_GtoI;
  filter_.set_imu(state);
}

void Estimator::watch(const EpochData& data) {
  bool any_new = false;
  for (ExcitationMonitor& monitor : monitors_) {
    if (monitor.epoch(filter_, data.imu)) any_new = true;
  }
  if (any_new && options_.monitor.hold) {
    filter_.held().clear();
    for (const ExcitationMonitor& monitor : monitors_) monitor.hold(filter_.held());
  }
  if (runner_.observer() != nullptr) runner_.observer()->on_epoch(filter_, data);
}

}  // namespace viwo
