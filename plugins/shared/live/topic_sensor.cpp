#include "topic_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <optional>
#include <set>
#include <utility>

#include "viwo/api/status.hpp"
#include "viwo/log/text.hpp"
#include "viwo/math/number_text.hpp"

namespace viwo::live {
namespace {

using namespace std::chrono_literals;

constexpr auto kPoll = 100ms;           ///< how late an end that nobody signals is seen
constexpr auto kTopicSilence = 1000ms;  ///< of one topic: worth a warning
constexpr auto kPublisherWait = 3s;     ///< before topics without publisher are named
constexpr auto kNoEstimate = 2s;        ///< without one: worth a warning
constexpr auto kNamingWait = 2s;        ///< until watch() has named them

/// Where sensors of this kind publish in this process.
std::mutex published_mutex;
std::set<std::string> published_to;

std::unique_ptr<MeasurementQueue> make_queue(const LiveParams& params, Pace pace) {
  const auto max_images = static_cast<std::size_t>(params.max_waiting_images);
  if (pace == Pace::kLive) return std::make_unique<LiveQueue>(max_images);
  return std::make_unique<StepQueue>(wanted_topics(params), max_images);
}

}  // namespace

TopicSensor::TopicSensor(const LiveParams& params, const HostServices& services,
                         MakeFields make_fields, Pace pace)
    : services_(services),
      options_(static_cast<const bag::TopicOptions&>(params)),
      make_fields_(make_fields),
      mounts_(params, services_),
      publish_(params.publish),
      sigma_rate_(params.sigma_rate_rad_per_s),
      warn_latency_s_(params.warn_latency_s),
      idle_timeout_(std::llround(1e3 * params.idle_timeout_s)),
      queue_(make_queue(params, pace)),
      steps_(dynamic_cast<StepQueue*>(queue_.get())),
      intake_(options_, services_, *queue_, make_fields, pace) {
  if (!publish_) return;
  const std::string topic = plain_name(params.odometry_topic_out);
  const std::scoped_lock lock(published_mutex);
  if (!published_to.insert(topic).second) {
    throw ParamError("publish", "another sensor of this run publishes the estimate as '" + topic +
                                    "': set publish: false here, or another odometry_topic_out");
  }
  publishes_to_ = topic;
  const std::string body = params.frames().body;
  const bool is_base = body.ends_with("base_link") || body.ends_with("base_footprint");  // REP 105
  const bool is_mounted =
      !params.imu_frame.empty() || !params.p_IinB_m.isZero(0.) || !params.rpy_ItoB_rad.isZero(0.);
  if (is_base && !is_mounted) {
    services_.log(LogLevel::kWarning,
                  "body_frame '" + body +
                      "' is taken to be that of the IMU, whose pose is published as its: where the "
                      "IMU sits in it is said by imu_frame, or by p_IinB_m and rpy_ItoB_rad");
  }
}

TopicSensor::~TopicSensor() {
  const std::scoped_lock lock(published_mutex);
  published_to.erase(publishes_to_);
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
    const auto last_use = intake_.last_use();
    const auto idle = Clock::now() - std::max(since, last_use.value_or(since));
    if (idle_timeout_ == 0ms || idle <= idle_timeout_) continue;
    hurries_ = !last_use;  // who hears nothing is to know of which topics, before it ends
    if (!hurries_ || named_missing_ || idle > idle_timeout_ + kNamingWait) {
      end(LogLevel::kInfo, "nothing has come for " +
                               number_text(1e-3 * double(idle_timeout_.count())) +
                               " s (idle_timeout_s)");
    }
  }
}

void TopicSensor::rejections(std::vector<RejectionCount>& out) const {
  intake_.rejections(out);
  queue_->rejections(out);
}

void TopicSensor::estimate(const EstimateSample& estimate) {
  last_estimate_ = Clock::now();
  const std::string trouble = mounts_.trouble(estimate);
  if (!publish_) return;
  std::optional<Odometry> odometry;
  if (const auto frames = mounts_.frames()) odometry = odometry_of(estimate, *frames, sigma_rate_);
  std::vector<RejectionCount> rejected;
  const Health health = health_now(trouble, rejected);
  const bool is_new = odometry && path_.add(odometry->pose, estimate.piece);
  publish({.diagnostics = diagnostics_of(estimate, health),
           .odometry = odometry ? &*odometry : nullptr,
           .path = is_new ? &path_ : nullptr,
           .calibration = estimate.calibration_names.empty() ? nullptr : &estimate});
}

Health TopicSensor::health_now(const std::string& trouble,
                               std::vector<RejectionCount>& rejected) const {
  Health health;
  health.trouble = trouble;
  // In step the wall's time tells nothing of a topic.
  if (steps_ == nullptr) health.silent_topics = intake_.silent_topics(kTopicSilence);
  rejections(rejected);
  for (const RejectionCount& r : rejected) health.rejected += r.count;
  health.warn_latency_s = warn_latency_s_;
  return health;
}

void TopicSensor::watch() {
  if (!named_missing_ && (hurries_ || Clock::now() - begin_ >= kPublisherWait)) {
    mounts_.say_missing();
    name_missing_topics();
    named_missing_ = true;
  }
  const Clock::time_point last = last_estimate_;
  const auto without = Clock::now() - last;
  if (!publish_ || steps_ != nullptr || without < kNoEstimate) return;
  std::optional<std::int64_t> lost_s;
  if (last != begin_) lost_s = std::chrono::duration_cast<std::chrono::seconds>(without).count();
  const std::int64_t t_ns = intake_.newest_ns().value_or(0);  // of the robot's clock, or of none
  std::vector<RejectionCount> rejected;
  const Health health = health_now("", rejected);
  publish({.diagnostics = diagnostics_without_estimate(t_ns, lost_s, health, rejected)});
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

void TopicSensor::take_transforms(std::span<const std::uint8_t> message) {
  try {
    mounts_.take(bag::read_transforms(*make_fields_(message)));
  } catch (const bag::BrokenMessage& broken) {
    mounts_.say_useless(std::string("/tf_static: a message that is broken: ") + broken.what());
  }
}

void TopicSensor::name_missing(const std::string& topic,
                               const std::vector<std::string>& there) const {
  services_.log(LogLevel::kWarning,
                "nobody publishes topic '" + topic + "'" +
                    (there.empty() ? " (nor any other)" : log::did_you_mean(topic, there)));
}

}  // namespace viwo::live
