#include "viwo/filter/estimator.hpp"

#include <algorithm>
#include <cmath>

#include <time.h>

namespace viwo {
namespace {

constexpr int kMaxFactorsPerUpdate = 16;
constexpr std::size_t kFirstWindow = 3;
constexpr std::size_t kEpochsPerClone = 3;
/// A stamp this far after that of the newest IMU sample is of another clock, or broken: taken, it
/// would make all that come after it late.
constexpr double kMaxAheadS = 10.;

/// CPU time of this thread: what an epoch costs, however busy the machine is with other things.
double thread_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

template <std::size_t kSize>
bool finite(const std::array<double, kSize>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

std::int64_t to_ns(double seconds) {
  return static_cast<std::int64_t>(std::llround(seconds * 1e9));
}

}  // namespace

Estimator::Estimator(const EstimatorOptions& options, std::vector<CameraPrior> cameras,
                     std::vector<WheelsPrior> wheels, std::vector<UpdateEntry> updates)
    : options_(options),
      filter_(options.filter, std::move(cameras), wheels),
      updates_(std::move(updates)),
      counts_(updates_.size()),
      gated_(updates_.size()),
      failures_(updates_.size()),
      sink_(kMaxFactorsPerUpdate, filter_.size()),
      moved_(Eigen::VectorXd::Zero(filter_.size())),
      information_factor_{{},
                          Eigen::MatrixXd::Zero(filter_.size(), filter_.size()),
                          Eigen::VectorXd::Zero(filter_.size())},
      encoders_(filter_.wheels().size()),
      stage_ms_(updates_.size() + 2, 0.) {
  for (std::size_t i = 0; options.monitor.enabled && i < wheels.size(); ++i) {
    wheels[i].wheels = filter_.wheels()[i];
    ExcitationMonitor monitor(options.monitor, wheels[i]);
    if (monitor.parameters().empty()) continue;
    monitors_.push_back(std::move(monitor));
    monitored_.push_back(i);
  }
  imu_.reserve(4096);
  cut_.reserve(4096);
  for (auto& samples : encoders_) samples.reserve(4096);
  for (const UpdateEntry& entry : updates_) {
    UpdateSetup setup;
    setup.max_clones = options.filter.clones + 1;
    setup.max_state_size = filter_.size();
    setup.cameras = filter_.cameras();
    if (entry.wheels >= 0) setup.wheels = &filter_.wheels()[static_cast<std::size_t>(entry.wheels)];
    if (entry.poses >= 0) {
      poses_.resize(std::max(poses_.size(), static_cast<std::size_t>(entry.poses) + 1));
    }
    start_update(entry, setup);
  }
  for (PoseStream& stream : poses_) {
    stream.waiting.reserve(1024);
    stream.taken.reserve(1024);
  }
}

void Estimator::reject(const char* reason, std::int64_t t_ns) {
  for (RejectionCount& known : rejections_) {
    if (known.reason == reason) {
      ++known.count;
      return;
    }
  }
  rejections_.push_back({reason, 1, "stamp " + std::to_string(t_ns) + " ns"});
}

std::vector<RejectionCount> Estimator::rejections() const {
  std::vector<RejectionCount> all = rejections_;
  for (std::size_t k = 0; k < updates_.size(); ++k) {
    const UpdateEntry& entry = updates_[k];
    const std::size_t before = all.size();
    entry.update->rejections(all);
    if (gated_[k].count > 0) {
      all.push_back({"measurement dropped by the chi-square gate", gated_[k].count,
                     "stamp " + std::to_string(gated_[k].first_ns) + " ns"});
    }
    for (std::size_t i = before; i < all.size(); ++i) {
      all[i].reason = entry.name + ": " + all[i].reason;
    }
  }
  return all;
}

std::vector<std::string> Estimator::stage_names() const {
  std::vector<std::string> names{"propagate"};
  for (const UpdateEntry& entry : updates_) names.push_back(entry.name);
  names.emplace_back("marginalise");
  return names;
}

bool Estimator::far_ahead(std::int64_t t_ns) const {
  return !imu_.empty() && seconds_between(imu_.back().t_ns, t_ns) > kMaxAheadS;
}

void Estimator::add(const ImuSample& sample) {
  if (!finite(sample.gyro_rad_per_s) || !finite(sample.accel_m_per_s2)) {
    return reject("IMU value that is not finite", sample.t_ns);
  }
  if (!imu_.empty()) {
    if (sample.t_ns <= imu_.back().t_ns) return reject("IMU stamp not after the last", sample.t_ns);
    if (seconds_between(imu_.back().t_ns, sample.t_ns) > options_.max_imu_gap_s) {
      reject("gap of the IMU bridged", sample.t_ns);
    }
  }
  imu_.push_back(sample);
  latest_ns_ = std::max(latest_ns_, sample.t_ns);
}

void Estimator::add(const FeatureSample& image) {
  if (filter_.initialized() && image.t_ns <= filter_.t_ns()) {
    return reject("image at or before the present epoch", image.t_ns);
  }
  if (far_ahead(image.t_ns)) return reject("image more than 10 s ahead of the IMU", image.t_ns);
  if (n_waiting_ > 0 && image.t_ns < waiting_[n_waiting_ - 1].t_ns) {
    return reject("image before the last one", image.t_ns);
  }
  // Storage of former images is used again.
  if (n_waiting_ == waiting_.size()) waiting_.emplace_back();
  FeatureSample& slot = waiting_[n_waiting_++];
  slot.t_ns = image.t_ns;
  slot.camera = image.camera;
  slot.points.assign(image.points.begin(), image.points.end());
  latest_ns_ = std::max(latest_ns_, image.t_ns);
}

void Estimator::add(const EncoderSample& sample, int wheels) {
  auto& samples = encoders_.at(static_cast<std::size_t>(wheels));
  if (!finite(sample.drive_rad_per_s) || !finite(sample.steer_rad)) {
    return reject("encoder value that is not finite", sample.t_ns);
  }
  if (sample.end_ns < sample.begin_ns) {
    return reject("encoder sample that ends before it begins", sample.t_ns);
  }
  const double t_OtoI_s = filter_.wheels()[static_cast<std::size_t>(wheels)].t_OtoI_s;
  if (far_ahead(sample.t_ns + to_ns(t_OtoI_s))) {
    return reject("encoder sample more than 10 s ahead of the IMU", sample.t_ns);
  }
  if (!samples.empty() && sample.begin_ns < samples.back().end_ns) {
    return reject("encoder sample that begins before the end of the last", sample.t_ns);
  }
  samples.push_back(sample);
}

void Estimator::add(const PoseSample& pose, int stream) {
  PoseStream& poses = poses_.at(static_cast<std::size_t>(stream));
  if (!finite(pose.p_BinW_m) || !finite(pose.q_BtoW_xyzw)) {
    return reject("pose that is not finite", pose.t_ns);
  }
  if (pose.t_ns <= poses.last_ns) return reject("pose stamp not after the last", pose.t_ns);
  poses.last_ns = pose.t_ns;
  if (pose.t_ns <= start_ns_) return reject("pose before the start", pose.t_ns);
  poses.waiting.push_back(pose);
}

bool Estimator::encoders_reach(std::int64_t t_ns) const {
  for (std::size_t i = 0; i < encoders_.size(); ++i) {
    const std::int64_t t_wheel = t_ns - to_ns(filter_.wheels()[i].t_OtoI_s);
    if (encoders_[i].empty() || encoders_[i].back().end_ns < t_wheel) return false;
  }
  return true;
}

bool Estimator::images_arrived(std::int64_t t_ns) const {
  if (finished_) return true;
  const std::int64_t wait_ns = to_ns(options_.max_image_wait_s);
  if (latest_ns_ > t_ns + wait_ns) return true;
  if (wait_ns == 0) return false;
  const auto is_of_epoch = [t_ns](const FeatureSample& image) { return image.t_ns == t_ns; };
  const auto n = std::count_if(
      waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(n_waiting_), is_of_epoch);
  return n >= static_cast<std::ptrdiff_t>(filter_.cameras().size());
}

std::optional<std::int64_t> Estimator::next_epoch_ns() const {
  if (imu_.empty()) return std::nullopt;
  const std::int64_t reached_ns = imu_.back().t_ns;
  std::int64_t t_ns = filter_.t_ns() + to_ns(options_.max_epoch_s);
  if (n_waiting_ > 0) t_ns = std::min(t_ns, waiting_.front().t_ns);
  if (reached_ns < t_ns) return std::nullopt;
  if (!images_arrived(t_ns)) return std::nullopt;
  const bool waited = finished_ || seconds_between(t_ns, latest_ns_) > options_.max_wait_s;
  if (!waited && !encoders_reach(t_ns)) return std::nullopt;
  return t_ns;
}

void Estimator::cut_imu(std::int64_t end_ns) {
  // imu_.front() is at, or the last one before, the present time of the filter.
  const std::int64_t begin_ns = filter_.t_ns();
  cut_.clear();
  for (std::size_t i = 0; i < imu_.size(); ++i) {
    const ImuSample& sample = imu_[i];
    if (sample.t_ns <= begin_ns) {
      if (sample.t_ns == begin_ns || i + 1 == imu_.size() || imu_[i + 1].t_ns > begin_ns) {
        cut_.clear();
        cut_.push_back(sample.t_ns == begin_ns || i + 1 == imu_.size()
                           ? sample
                           : interpolate(sample, imu_[i + 1], begin_ns));
        cut_.back().t_ns = begin_ns;
      }
      continue;
    }
    if (cut_.empty()) {  // the IMU begins after the start: its first reading holds before
      cut_.push_back(sample);
      cut_.back().t_ns = begin_ns;
    }
    if (sample.t_ns >= end_ns) {
      cut_.push_back(sample.t_ns == end_ns
                         ? sample
                         : interpolate(i > 0 ? imu_[i - 1] : cut_.back(), sample, end_ns));
      return;
    }
    cut_.push_back(sample);
  }
}

void Estimator::take_images(std::int64_t t_ns) {
  n_images_ = 0;
  std::size_t taken = 0;
  while (taken < n_waiting_ && waiting_[taken].t_ns <= t_ns) {
    if (n_images_ == images_.size()) images_.emplace_back();
    std::swap(images_[n_images_++], waiting_[taken++]);
  }
  std::rotate(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(taken),
              waiting_.begin() + static_cast<std::ptrdiff_t>(n_waiting_));
  n_waiting_ -= taken;
}

void Estimator::PoseStream::take(std::int64_t t_ns) {
  const auto end = std::find_if(waiting.begin(), waiting.end(),
                                [t_ns](const PoseSample& pose) { return pose.t_ns > t_ns; });
  taken.assign(waiting.begin(), end);
  waiting.erase(waiting.begin(), end);
}

void Estimator::forget_used() {
  // The IMU from the last sample at or before now on, encoders from the oldest clone on.
  std::size_t first = 0;
  while (first + 1 < imu_.size() && imu_[first + 1].t_ns <= filter_.t_ns()) ++first;
  imu_.erase(imu_.begin(), imu_.begin() + static_cast<std::ptrdiff_t>(first));
  const std::int64_t oldest_ns =
      filter_.clones().empty() ? filter_.t_ns() : filter_.clones().front().t_ns;
  constexpr double kMarginS = 0.5;  // for clocks that are found to be off, and interpolation
  for (std::size_t i = 0; i < encoders_.size(); ++i) {
    const std::int64_t keep_ns = oldest_ns - to_ns(filter_.wheels()[i].t_OtoI_s + kMarginS);
    auto& samples = encoders_[i];
    const auto keep = std::find_if(samples.begin(), samples.end(),
                                   [&](const EncoderSample& s) { return s.end_ns >= keep_ns; });
    // Moving them all every time is not worth while.
    if (keep - samples.begin() > 64) samples.erase(samples.begin(), keep);
  }
}

void Estimator::update_monitors() {
  bool any_new = false;
  for (std::size_t i = 0; i < monitors_.size(); ++i) {
    if (monitors_[i].epoch(filter_, filter_.wheels()[monitored_[i]], cut_)) any_new = true;
  }
  if (!any_new || !options_.monitor.hold) return;
  filter_.held().clear();
  for (const ExcitationMonitor& monitor : monitors_) monitor.hold(filter_.held());
}

bool Estimator::step() {
  if (!failure_.empty()) return false;
  if (!filter_.initialized() && !try_to_initialize()) return false;
  const auto t_ns = next_epoch_ns();
  if (!t_ns) return false;

  double before_ms = thread_ms();
  const auto stage_done = [&before_ms](double& spent_ms) {
    const double now_ms = thread_ms();
    spent_ms = now_ms - before_ms;
    before_ms = now_ms;
  };
  EpochData data;
  data.begin_ns = filter_.t_ns();
  data.end_ns = *t_ns;
  take_images(*t_ns);
  for (PoseStream& stream : poses_) stream.take(*t_ns);
  cut_imu(*t_ns);
  if (options_.growing_window) {
    filter_.limit_window(kFirstWindow + static_cast<std::size_t>(epochs_) / kEpochsPerClone);
  }
  const ImuTransition transition = filter_.propagate(cut_);
  filter_.clone(cut_.back());
  if (observer_ != nullptr) observer_->on_clone(filter_, transition.Phi);
  data.imu = cut_;
  data.features = {images_.data(), n_images_};
  stage_done(stage_ms_.front());
  for (std::size_t i = 0; i < updates_.size(); ++i) {
    const int wheels = updates_[i].wheels;
    if (wheels >= 0) data.encoders = encoders_[static_cast<std::size_t>(wheels)];
    data.poses = {};
    if (updates_[i].poses >= 0) {
      data.poses = poses_[static_cast<std::size_t>(updates_[i].poses)].taken;
    }
    run_update(i, data);
    stage_done(stage_ms_[i + 1]);
  }
  update_monitors();
  if (observer_ != nullptr) observer_->on_epoch(filter_, data);
  if (filter_.window_full()) filter_.drop_oldest_clone();
  forget_used();
  failure_ = filter_.failure();
  ++epochs_;
  stage_done(stage_ms_.back());
  return true;
}

}  // namespace viwo
