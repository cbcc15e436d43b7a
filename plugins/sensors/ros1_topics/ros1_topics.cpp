// Sensor ros1_topics: measurements of a running ROS 1 system as they come, and the estimate back to
// it (model.md).
#include <chrono>
#include <cmath>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

#include <ros/callback_queue.h>
#include <ros/names.h>
#include <ros/ros.h>

#include "live_params.hpp"
#include "master.hpp"
#include "raw_message.hpp"
#include "ros1_fields.hpp"
#include "ros1_messages.hpp"
#include "topic_sensor.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo::ros1 {
namespace {

using namespace std::chrono_literals;

/// Why this cannot be the name of a topic; empty for one that can.
std::string why_no_name(const std::string& topic) {
  std::string error;
  if (topic.empty()) return "it is empty";
  return ros::names::validate(topic, error) ? std::string() : error;
}

struct Params : live::LiveParams {
  std::string master_uri;
  double connect_timeout_s = 2.;

  void bind(ParamBinder& b) {
    live::LiveParams::bind(b);
    b(VIWO_PARAM(master_uri),
      {.help = "http://HOST:PORT of the ROS master; empty: the environment's "
               "ROS_MASTER_URI, or else this machine's"});
    b(VIWO_PARAM(connect_timeout_s),
      {.unit = "s", .min = 0., .max = 3600., .help = "how long to wait for a ROS master"});
  }
  const Params& checked() const {
    live::LiveParams::checked(why_no_name);
    return *this;
  }
};

/// Of tf2_msgs/TFMessage.
constexpr const char* kTransformsMd5 = "94810edda583a504dfda3829e70d7eec";
constexpr auto kSilence = 2s;  ///< without any message the master is asked for
constexpr auto kProbe = 1000ms;
using Event = ros::MessageEvent<const RawMessage>;

std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(std::llround(1e3 * seconds));
}

std::unique_ptr<bag::FieldReader> fields_of(std::span<const std::uint8_t> message) {
  return std::make_unique<bag::Ros1Fields>(message);
}

class Ros1Topics final : public live::TopicSensor {
 public:
  Ros1Topics(const Params& params, const HostServices& services)
      : TopicSensor(params.checked(), services, fields_of),
        master_(master_address(params.master_uri)),
        description_(params.description_topic) {
    join(master_, milliseconds(params.connect_timeout_s));
    node_ = std::make_unique<ros::NodeHandle>();
    node_->setCallbackQueue(&callbacks_);
    subscribe();
    if (params.publish) advertise(params);
    if (mounts().are_asked_for()) ask_for_mounts();
    watch_ = node_->createWallTimer(ros::WallDuration(1.),
                                    [this](const ros::WallTimerEvent&) { watch_master(); });
    // Two threads: watch_master() may wait for the master, messages must not.
    spinner_ = std::make_unique<ros::AsyncSpinner>(2, &callbacks_);
    spinner_->start();
  }

  ~Ros1Topics() override {
    stop();
    spinner_->stop();
    watch_.stop();
    subscribers_.clear();
    tf_static_.shutdown();
    callbacks_.disable();
    callbacks_.clear();
  }

 private:
  std::string gone() const override {
    return ros::ok() ? std::string() : "ROS has shut this node down";
  }

  void publish(const live::Outgoing& out) override {
    const live::Odometry* const odometry = out.odometry;
    if (odometry != nullptr) odometry_.publish(odometry_message(*odometry));
    if (tf_ && odometry != nullptr) tf_.publish(tf_message(*odometry));
    if (path_ && out.path != nullptr) path_.publish(path_message(*out.path, odometry->world));
    if (calibration_ && out.calibration != nullptr) {
      calibration_.publish(calibration_message(*out.calibration));
    }
    diagnostics_.publish(diagnostics_message(out.diagnostics));
  }

  void subscribe() {
    // Messages that are received and not looked at yet. Looking at one takes microseconds, and the
    // queue behind it has limits of its own and counts: these are never reached.
    constexpr std::uint32_t kMostImages = 100, kMostOthers = 10'000;
    for (std::size_t i = 0; i < intake().topics().size(); ++i) {
      const live::Topic& topic = intake().topics()[i];
      subscribers_.push_back(subscribe(
          topic.name, topic.camera < 0 ? kMostOthers : kMostImages, [this, i](const Event& event) {
            const ros::M_string& connection = event.getConnectionHeader();
            const auto message = event.getMessage();
            intake().take(i, connection.at("type"), connection.at("md5sum"),
                          {&message->bytes, [message](const bag::Bytes*) {}});
          }));
    }
  }

  template <class Callback>
  ros::Subscriber subscribe(const std::string& topic, std::uint32_t most, Callback callback) {
    ros::SubscribeOptions wanted;
    const auto guarded = [this, callback](const Event& event) {
      try {  // roscpp's thread would end the process
        callback(event);
      } catch (const std::exception& error) {
        fail(error.what());
      }
    };
    wanted.template initByFullCallbackType<const Event&>(topic, most, guarded);
    wanted.transport_hints = ros::TransportHints().tcpNoDelay();
    return node_->subscribe(wanted);
  }

  void advertise(const Params& params) {
    odometry_ = node_->advertise<msg::Odometry>(params.odometry_topic_out, 10);
    if (params.publish_tf) tf_ = node_->advertise<msg::TFMessage>("/tf", 10);
    if (!params.path_topic_out.empty()) {
      path_ = node_->advertise<msg::Path>(params.path_topic_out, 1);
    }
    if (!params.calibration_topic_out.empty()) {
      calibration_ = node_->advertise<msg::JointState>(params.calibration_topic_out, 10);
    }
    diagnostics_ = node_->advertise<msg::DiagnosticArray>("/diagnostics", 10);
  }

  void ask_for_mounts() {
    tf_static_ = subscribe("/tf_static", 100, [this](const Event& event) {
      if (event.getConnectionHeader().at("md5sum") != kTransformsMd5) return;
      take_transforms(event.getMessage()->bytes);
    });
  }

  /// A parameter that may be set later. The master is asked for nothing when it is not there.
  void ask_for_description() {
    if (description_.empty() || mounts().are_known()) return;
    if (!answers(master_, kProbe)) return;
    std::string urdf;
    if (!ros::param::get(description_, urdf)) return;
    mounts().take_description(urdf);
    description_.clear();
  }

  /// Every second.
  void watch_master() {
    if (is_idle(kSilence) && !answers(master_, kProbe)) {
      end(LogLevel::kWarning, "the ROS master at " + master_.uri + " is gone and nothing comes");
      return;
    }
    ask_for_description();
    watch();
  }

  void name_missing_topics() const override {
    std::vector<std::string> there;
    for (std::size_t i = 0; i < subscribers_.size(); ++i) {
      if (subscribers_[i].getNumPublishers() > 0) continue;
      if (there.empty()) there = topics_with_publisher();
      name_missing(intake().topics()[i].name, there);
    }
  }

  std::vector<std::string> topics_with_publisher() const {
    ros::master::V_TopicInfo topics;
    std::set<std::string> names;
    if (ros::master::getTopics(topics)) {
      for (const ros::master::TopicInfo& topic : topics) names.insert(topic.name);
    }
    for (const ros::Publisher& own : {odometry_, path_, tf_, diagnostics_}) {
      if (own) names.erase(own.getTopic());
    }
    return {names.begin(), names.end()};
  }

  MasterAddress master_;
  std::string description_;  ///< name of a parameter; empty when it is not asked for any more
  ros::CallbackQueue callbacks_;
  std::unique_ptr<ros::NodeHandle> node_;
  std::vector<ros::Subscriber> subscribers_;
  ros::Subscriber tf_static_;
  ros::Publisher odometry_, path_, tf_, calibration_, diagnostics_;
  ros::WallTimer watch_;
  std::unique_ptr<ros::AsyncSpinner> spinner_;
};

VIWO_REGISTER(Sensor, Ros1Topics, "ros1_topics", "1.0.0",
              "IMU, images, wheels and poses of a running ROS 1 system; publishes the estimate",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo::ros1
