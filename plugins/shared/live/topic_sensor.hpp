// A sensor that listens to the topics of a running system, whichever ROS it is of: what is done
// with messages that have come, and with estimates that are to go.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "estimate_messages.hpp"
#include "intake.hpp"
#include "live_params.hpp"
#include "live_queue.hpp"
#include "mounts.hpp"
#include "step_queue.hpp"
#include "viwo/api/host_services.hpp"
#include "viwo/api/sensor.hpp"

namespace viwo::live {

/// What goes out at once; null: not now.
struct Outgoing {
  const Diagnostics& diagnostics;
  const Odometry* odometry = nullptr;  ///< null while nothing says where the body is
  const Path* path = nullptr;          ///< null likewise, and where it is the same as before
  const EstimateSample* calibration = nullptr;  ///< null where nothing is calibrated
};

class TopicSensor : public Sensor {
 public:
  using Clock = std::chrono::steady_clock;

  ~TopicSensor() override;

  SampleTypes yields() const final { return bag::kinds_of(options_); }
  bool live() const final { return true; }
  void stop() final { queue_->end(); }
  Status next(Measurement& out) final;
  void rejections(std::vector<RejectionCount>& out) const final;
  void estimate(const EstimateSample& estimate) final;

 protected:
  /// ParamError where another one publishes to the same topic.
  TopicSensor(const LiveParams& params, const HostServices& services, MakeFields make_fields,
              Pace pace = Pace::kLive);

  /// Why nothing will come any more, although nobody has said so; empty while it may.
  virtual std::string gone() const { return {}; }
  virtual void publish(const Outgoing& out) = 0;

  /// Ends the sensor, and says why.
  void end(LogLevel level, const std::string& why);
  /// Ends it with an InputError of next(): what it has given is not what it should have.
  void fail(const std::string& why);
  /// A message of /tf_static.
  void take_transforms(std::span<const std::uint8_t> message);

  /// Whether nothing that could be used has come for this long.
  bool is_idle(Clock::duration longer_than) const;
  /// Every second: topics without publisher are named once, and while there is no estimate that is
  /// published as a warning.
  void watch();
  /// Calls name_missing() for topics that nobody publishes.
  virtual void name_missing_topics() const = 0;
  /// `there`: the topics that are published.
  void name_missing(const std::string& topic, const std::vector<std::string>& there) const;

  const HostServices& services() const { return services_; }
  Mounts& mounts() { return mounts_; }
  Intake& intake() { return intake_; }
  const Intake& intake() const { return intake_; }
  /// Of a sensor that is played in step; null of others.
  StepQueue* steps() { return steps_; }

 private:
  Health health_now(const std::string& trouble, std::vector<RejectionCount>& rejected) const;

  HostServices services_;
  bag::TopicOptions options_;
  MakeFields make_fields_;
  Mounts mounts_;
  bool publish_;
  double sigma_rate_;
  double warn_latency_s_;
  std::chrono::milliseconds idle_timeout_;
  Path path_;
  Clock::time_point begin_ = Clock::now();
  std::atomic<Clock::time_point> last_estimate_ = begin_;  ///< begin_: there was none
  std::atomic<bool> named_missing_ = false;
  std::atomic<bool> hurries_ = false;  ///< to name them: next() is about to end
  std::string publishes_to_;
  std::unique_ptr<MeasurementQueue> queue_;
  StepQueue* steps_ = nullptr;
  Intake intake_;
  std::mutex failure_mutex_;
  std::string failure_;
};

}  // namespace viwo::live
