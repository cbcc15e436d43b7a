// Sensor ros1_topics: measurements of a running ROS 1 system as they come, and the estimate back to
// it (model.md).
#include <chrono>
#include <cmath>
#include <memory>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include "estimate_messages.hpp"
#include "intake.hpp"
#include "live_queue.hpp"
#include "master.hpp"
#include "topic_names.hpp"
#include "viwo/api/plugin.hpp"
#include "viwo/log/text.hpp"

namespace viwo::ros1 {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

struct Params : bag::TopicOptions {
  std::string master_uri;
  double connect_timeout_s = 2.;
  double idle_timeout_s = 0.;
  int max_waiting_images = 32;
  bool publish = true;
  std::string odometry_topic_out = "viwo/odometry";
  bool publish_tf = true;
  std::string world_frame = "odom";
  std::string body_frame = "imu";
  Eigen::Vector3d p_IinB_m{0., 0., 0.};
  Eigen::Vector3d rpy_ItoB_rad{0., 0., 0.};
  double sigma_rate_rad_per_s = 0.01;
  double warn_latency_s = 0.25;

  void bind(ParamBinder& b) {
    bag::TopicOptions::bind(b);
    b(VIWO_PARAM(master_uri),
      {.help = "http://HOST:PORT of the ROS master; empty: the environment's "
               "ROS_MASTER_URI, or else this machine's"});
    b(VIWO_PARAM(connect_timeout_s),
      {.unit = "s", .min = 0., .max = 3600., .help = "how long to wait for a ROS master"});
    b(VIWO_PARAM(idle_timeout_s),
      {.unit = "s",
       .min = 0.,
       .max = 1e6,
       .help = "the run ends when nothing has come for this long; 0: it goes on"});
    b(VIWO_PARAM(max_waiting_images),
      {.min = 2.,
       .max = 10000.,
       .help = "images that are held until they are taken; then the oldest are dropped"});
    b(VIWO_PARAM(publish),
      {.help = "whether the estimate is published: odometry, tf and diagnostics"});
    b(VIWO_PARAM(odometry_topic_out), {.help = "nav_msgs/Odometry"});
    b(VIWO_PARAM(publish_tf), {.help = "whether the pose is on /tf, too"});
    b(VIWO_PARAM(world_frame), {.help = "frame of the poses"});
    b(VIWO_PARAM(body_frame), {.help = "frame whose pose is published"});
    b(VIWO_PARAM(p_IinB_m), {.unit = "m", .help = "origin of the IMU in body_frame"});
    b(VIWO_PARAM(rpy_ItoB_rad),
      {.unit = "rad", .help = "roll, pitch, yaw of the IMU in body_frame, R_ItoB = Rz Ry Rx"});
    b(VIWO_PARAM(sigma_rate_rad_per_s),
      {.unit = "rad/s", .min = 0., .help = "of the angular rate in the published twist"});
    b(VIWO_PARAM(warn_latency_s),
      {.unit = "s",
       .min = 0.,
       .help = "a longer time from image to pose is a warning in the diagnostics"});
  }
};

constexpr auto kPoll = 100ms;           ///< how late an end that nobody signals is seen
constexpr auto kSilence = 2s;           ///< without any message the master is asked for
constexpr auto kTopicSilence = 1000ms;  ///< of one topic: worth a warning
constexpr auto kPublisherWait = 3s;     ///< before topics without publisher are named
constexpr auto kProbe = 1000ms;

OutputFrames frames_from(const Params& params) {
  OutputFrames frames;
  frames.world = params.world_frame;
  frames.body = params.body_frame;
  if (frames.world.empty()) throw ParamError("world_frame", "a frame needs a name");
  if (frames.body.empty()) throw ParamError("body_frame", "a frame needs a name");
  if (frames.world == frames.body) {
    throw ParamError("body_frame", "'" + frames.body + "' is the world_frame, too");
  }
  const Eigen::Vector3d rpy = params.rpy_ItoB_rad;
  frames.R_ItoB = (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
                   Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  frames.p_IinB = params.p_IinB_m;
  return frames;
}

std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(std::llround(1e3 * seconds));
}

class Ros1Topics final : public Sensor {
 public:
  Ros1Topics(const Params& params, const HostServices& services)
      : services_(services),
        options_(checked(params)),
        frames_(frames_from(params)),
        sigma_rate_(params.sigma_rate_rad_per_s),
        warn_latency_s_(params.warn_latency_s),
        idle_timeout_(milliseconds(params.idle_timeout_s)),
        master_(master_address(params.master_uri)),
        queue_(static_cast<std::size_t>(params.max_waiting_images)),
        intake_(options_, services_, queue_) {
    const std::string& out = params.odometry_topic_out;
    check_name("odometry_topic_out", out);
    join(master_, milliseconds(params.connect_timeout_s));
    node_ = std::make_unique<ros::NodeHandle>();
    node_->setCallbackQueue(&callbacks_);
    subscribe();
    if (params.publish) advertise(out, params.publish_tf);
    watch_ = node_->createWallTimer(ros::WallDuration(1.),
                                    [this](const ros::WallTimerEvent&) { watch(); });
    // Two threads: watch() may wait for the master, messages must not.
    spinner_ = std::make_unique<ros::AsyncSpinner>(2, &callbacks_);
    spinner_->start();
  }

  ~Ros1Topics() override {
    queue_.end();
    spinner_->stop();
    watch_.stop();
    subscribers_.clear();
    callbacks_.disable();
    callbacks_.clear();
  }

  SampleTypes yields() const override { return bag::kinds_of(options_); }
  bool live() const override { return true; }
  void stop() override { queue_.end(); }

  Status next(Measurement& out) override {
    auto since = Clock::now();
    while (true) {
      switch (queue_.pop(out, kPoll)) {
        case LiveQueue::Taken::kMeasurement:
          return Status::kOk;
        case LiveQueue::Taken::kEnded:
          return Status::kEnd;
        case LiveQueue::Taken::kNothing:
          break;
      }
      if (!ros::ok()) {
        end(LogLevel::kWarning, "ROS has shut this node down");
        continue;
      }
      if (const auto last = intake_.last_use()) since = std::max(since, *last);
      if (idle_timeout_ > 0ms && Clock::now() - since > idle_timeout_) {
        end(LogLevel::kInfo, "nothing has come for " +
                                 log::number_text(1e-3 * double(idle_timeout_.count())) +
                                 " s (idle_timeout_s)");
      }
    }
  }

  void rejections(std::vector<RejectionCount>& out) const override {
    intake_.rejections(out);
    queue_.rejections(out);
  }

  void estimate(const EstimateSample& estimate) override {
    if (!odometry_) return;
    const msg::Odometry odometry = odometry_message(estimate, frames_, sigma_rate_);
    odometry_.publish(odometry);
    if (tf_) tf_.publish(tf_message(odometry));
    Health health;
    health.silent_topics = intake_.silent_topics(kTopicSilence);
    std::vector<RejectionCount> rejected;
    rejections(rejected);
    for (const RejectionCount& r : rejected) health.rejected += r.count;
    health.warn_latency_s = warn_latency_s_;
    diagnostics_.publish(diagnostics_message(estimate, health));
  }

 private:
  void subscribe() {
    // Messages that are received and not looked at yet. Looking at one takes microseconds, and the
    // queue behind it has limits of its own and counts: these are never reached.
    constexpr std::uint32_t kMostImages = 100, kMostOthers = 10'000;
    const auto hints = ros::TransportHints().tcpNoDelay();
    for (std::size_t i = 0; i < intake_.topics().size(); ++i) {
      ros::SubscribeOptions wanted;
      wanted.template initByFullCallbackType<const ros::MessageEvent<const RawMessage>&>(
          intake_.topics()[i].name, intake_.topics()[i].camera < 0 ? kMostOthers : kMostImages,
          [this, i](const ros::MessageEvent<const RawMessage>& event) {
            const ros::M_string& connection = event.getConnectionHeader();
            intake_.take(i, connection.at("type"), connection.at("md5sum"), event.getMessage());
          });
      wanted.transport_hints = hints;
      subscribers_.push_back(node_->subscribe(wanted));
    }
  }

  void advertise(const std::string& odometry_topic, bool with_tf) {
    odometry_ = node_->advertise<msg::Odometry>(odometry_topic, 10);
    if (with_tf) tf_ = node_->advertise<msg::TFMessage>("/tf", 10);
    diagnostics_ = node_->advertise<msg::DiagnosticArray>("/diagnostics", 10);
  }

  void end(LogLevel level, const std::string& why) {
    if (queue_.ended()) return;
    services_.log(level, why + ": no further measurements");
    queue_.end();
  }

  /// Every second.
  void watch() {
    if (!named_missing_ && Clock::now() - begin_ > kPublisherWait) {
      named_missing_ = true;
      name_missing_topics();
    }
    auto since = begin_;
    if (const auto last = intake_.last_use()) since = *last;
    if (Clock::now() - since > kSilence && !is_reachable(master_, kProbe)) {
      end(LogLevel::kWarning, "the ROS master at " + master_.uri + " is gone and nothing comes");
    }
  }

  /// Topics that nobody publishes, with those that were perhaps meant.
  void name_missing_topics() {
    std::vector<std::string> there;
    for (std::size_t i = 0; i < subscribers_.size(); ++i) {
      if (subscribers_[i].getNumPublishers() > 0) continue;
      if (there.empty()) there = topics_with_publisher();
      services_.log(LogLevel::kWarning,
                    "nobody publishes topic '" + intake_.topics()[i].name + "'" +
                        (there.empty() ? " (nor any other)"
                                       : log::did_you_mean(intake_.topics()[i].name, there)));
    }
  }

  std::vector<std::string> topics_with_publisher() const {
    ros::master::V_TopicInfo topics;
    std::set<std::string> names;
    if (ros::master::getTopics(topics)) {
      for (const ros::master::TopicInfo& topic : topics) names.insert(topic.name);
    }
    for (const ros::Publisher& own : {odometry_, tf_, diagnostics_}) {
      if (own) names.erase(own.getTopic());
    }
    return {names.begin(), names.end()};
  }

  HostServices services_;
  bag::TopicOptions options_;
  OutputFrames frames_;
  double sigma_rate_;
  double warn_latency_s_;
  std::chrono::milliseconds idle_timeout_;
  MasterAddress master_;
  LiveQueue queue_;
  Intake intake_;
  Clock::time_point begin_ = Clock::now();
  bool named_missing_ = false;  ///< only watch() has it

  ros::CallbackQueue callbacks_;
  std::unique_ptr<ros::NodeHandle> node_;
  std::vector<ros::Subscriber> subscribers_;
  ros::Publisher odometry_, tf_, diagnostics_;
  ros::WallTimer watch_;
  std::unique_ptr<ros::AsyncSpinner> spinner_;
};

VIWO_REGISTER(Sensor, Ros1Topics, "ros1_topics", "1.0.0",
              "IMU, images, wheels and poses of a running ROS 1 system; publishes the estimate",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo::ros1
