#include "topic_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include <Eigen/Geometry>

#include "viwo/api/status.hpp"
#include "viwo/log/text.hpp"
#include "viwo/math/rpy.hpp"
#include "viwo/math/significant.hpp"

namespace viwo::live {
namespace {

using namespace std::chrono_literals;

constexpr auto kPoll = 100ms;           ///< how late an end that nobody signals is seen
constexpr auto kTopicSilence = 1000ms;  ///< of one topic: worth a warning
constexpr auto kPublisherWait = 3s;     ///< before topics without publisher are named

std::string list_text(const Eigen::Vector3d& v) {
  std::string text;
  for (const double value : v) text += (text.empty() ? "[" : ", ") + significant(value, 6);
  return text + "]";
}

std::unique_ptr<MeasurementQueue> make_queue(const LiveParams& params, Pace pace) {
  const auto max_images = static_cast<std::size_t>(params.max_waiting_images);
  if (pace == Pace::kLive) return std::make_unique<LiveQueue>(max_images);
  return std::make_unique<StepQueue>(wanted_topics(params), max_images);
}

}  // namespace

TopicSensor::TopicSensor(const LiveParams& params, const HostServices& services,
                         MakeFields make_fields, Pace pace)
    : services_(services),
      options_(params),
      make_fields_(make_fields),
      imu_frame_(params.imu_frame),
      frames_(params.frames()),
      has_mount_(params.imu_frame.empty()),
      publish_(params.publish),
      sigma_rate_(params.sigma_rate_rad_per_s),
      warn_latency_s_(params.warn_latency_s),
      idle_timeout_(std::llround(1e3 * params.idle_timeout_s)),
      queue_(make_queue(params, pace)),
      steps_(dynamic_cast<StepQueue*>(queue_.get())),
      intake_(options_, services_, *queue_, make_fields, pace) {
  if (asks_for_mount()) find_mount("");  // of a frame in itself it is known
}

Status TopicSensor::next(Measurement& out) {
  const auto since = Clock::now();
  while (true) {
    switch (queue_->pop(out, kPoll)) {
      case MeasurementQueue::Taken::kMeasurement:
        return Status::kOk;
      case MeasurementQueue::Taken::kEnded: {
        const std::scoped_lock lock(failure_mutex_);
        if (!failure_.empty()) throw InputError(failure_);
        return Status::kEnd;
      }
      case MeasurementQueue::Taken::kNothing:
        break;
    }
    if (const std::string why = gone(); !why.empty()) {
      end(LogLevel::kWarning, why);
      continue;
    }
    const auto last = std::max(since, intake_.last_use().value_or(since));
    if (idle_timeout_ > 0ms && Clock::now() - last > idle_timeout_) {
      end(LogLevel::kInfo, "nothing has come for " +
                               log::number_text(1e-3 * double(idle_timeout_.count())) +
                               " s (idle_timeout_s)");
    }
  }
}

void TopicSensor::rejections(std::vector<RejectionCount>& out) const {
  intake_.rejections(out);
  queue_->rejections(out);
}

void TopicSensor::estimate(const EstimateSample& estimate) {
  if (!publish_) return;
  Health health;
  std::optional<Odometry> odometry;
  {
    const std::scoped_lock lock(mount_mutex_);
    if (has_mount_) odometry = odometry_of(estimate, frames_, sigma_rate_);
  }
  if (!odometry) {
    health.trouble = "nothing says where frame '" + imu_frame_ + "' is in '" + frames_.body + "'";
  }
  health.silent_topics = intake_.silent_topics(kTopicSilence);
  std::vector<RejectionCount> rejected;
  rejections(rejected);
  for (const RejectionCount& r : rejected) health.rejected += r.count;
  health.warn_latency_s = warn_latency_s_;
  const bool is_new = odometry && path_.add(odometry->pose, estimate.piece);
  publish(odometry ? &*odometry : nullptr, is_new ? &path_ : nullptr,
          diagnostics_of(estimate, health));
}

void TopicSensor::end(LogLevel level, const std::string& why) {
  if (queue_->ended()) return;
  services_.log(level, why + ": no further measurements");
  queue_->end();
}

void TopicSensor::fail(const std::string& why) {
  {
    const std::scoped_lock lock(failure_mutex_);
    if (failure_.empty()) failure_ = why;
  }
  queue_->end();
}

bool TopicSensor::is_idle(Clock::duration longer_than) const {
  return Clock::now() - intake_.last_use().value_or(begin_) > longer_than;
}

bool TopicSensor::is_time_to_name_missing() {
  if (named_missing_ || Clock::now() - begin_ < kPublisherWait) return false;
  named_missing_ = true;
  if (asks_for_mount()) say_missing_mount();
  return true;
}

bool TopicSensor::has_mount() const {
  const std::scoped_lock lock(mount_mutex_);
  return has_mount_;
}

void TopicSensor::take_transforms(std::span<const std::uint8_t> message) {
  std::string why;
  try {
    for (const bag::Transform& transform : bag::read_transforms(*make_fields_(message))) {
      const std::scoped_lock lock(mount_mutex_);
      if (const std::string no = tree_.add(transform); !no.empty()) why = no;
    }
  } catch (const bag::BrokenMessage& broken) {
    why = std::string("a message that is broken: ") + broken.what();
  }
  find_mount(why.empty() ? "" : "/tf_static: " + why);
}

void TopicSensor::take_description(const std::string& urdf) {
  FrameTree described;  // to read it takes time, which the estimate is not to wait for
  const std::string why = described.add_urdf(urdf);
  {
    const std::scoped_lock lock(mount_mutex_);
    tree_.merge(described);
  }
  find_mount(why);
}

void TopicSensor::find_mount(const std::string& why_not_all) {
  if (!why_not_all.empty()) say_once(LogLevel::kWarning, why_not_all + "; it is not used");
  std::string text;
  {
    const std::scoped_lock lock(mount_mutex_);
    const auto found = tree_.find(imu_frame_, frames_.body);
    if (!found) return;
    const bool is_same = has_mount_ && found->R_AtoB.isApprox(frames_.R_ItoB, 1e-9) &&
                         found->p_AinB.isApprox(frames_.p_IinB, 1e-9);
    if (is_same) return;
    has_mount_ = true;
    frames_.R_ItoB = found->R_AtoB;
    frames_.p_IinB = found->p_AinB;
    text = "frame '" + imu_frame_ + "' is in '" + frames_.body +
           "' at p_IinB_m: " + list_text(frames_.p_IinB) +
           ", rpy_ItoB_rad: " + list_text(rpy_of_rotation(frames_.R_ItoB));
  }
  say_once(LogLevel::kInfo, text);
}

void TopicSensor::say_once(LogLevel level, const std::string& text) {
  constexpr std::size_t kMost = 20;
  {
    const std::scoped_lock lock(mount_mutex_);
    if (said_.size() >= kMost || !said_.insert(text).second) return;
  }
  services_.log(level, text);
}

void TopicSensor::say_missing_mount() {
  std::string text;
  {
    const std::scoped_lock lock(mount_mutex_);
    if (has_mount_) return;
    text = "nothing says where frame '" + imu_frame_ + "' is in '" + frames_.body +
           "': no pose is published";
    const auto names = tree_.names();
    bool are_there = true;
    for (const std::string& wanted : {plain_name(imu_frame_), plain_name(frames_.body)}) {
      if (names.empty() || std::find(names.begin(), names.end(), wanted) != names.end()) continue;
      are_there = false;
      text += "; there is no '" + wanted + "'" + log::did_you_mean(wanted, names);
    }
    if (names.empty()) {
      text += " (no frame is known from /tf_static or the robot's description)";
    } else if (are_there) {
      text += ": both are there, but no fixed frames join them";
    }
  }
  services_.log(LogLevel::kWarning, text);
}

void TopicSensor::name_missing(const std::string& topic,
                               const std::vector<std::string>& there) const {
  services_.log(LogLevel::kWarning,
                "nobody publishes topic '" + topic + "'" +
                    (there.empty() ? " (nor any other)" : log::did_you_mean(topic, there)));
}

}  // namespace viwo::live
