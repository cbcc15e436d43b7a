// Sensor ros2_topics: measurements of a running ROS 2 system as they come, by DDS, and the estimate
// back to it (model.md).
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "dds_names.hpp"
#include "dds_node.hpp"
#include "dds_settings.hpp"
#include "live_params.hpp"
#include "ros2_fields.hpp"
#include "ros2_messages.hpp"
#include "topic_sensor.hpp"
#include "viwo/api/plugin.hpp"

namespace viwo::ros2 {
namespace {

using namespace std::chrono_literals;
using live::Pace;

struct Params : live::LiveParams, DdsParams {
  bool reliable = false;
  bool lockstep = false;

  void bind(ParamBinder& b) {
    live::LiveParams::bind(b);
    DdsParams::bind(b);
    b(VIWO_PARAM(reliable),
      {.help = "whether what is lost on the way is asked for again: publishers that are best "
               "effort, as drivers often are, are then not heard"});
    b(VIWO_PARAM(lockstep),
      {.help = "played, not live: nothing is dropped, and measurements are those of a bag; set by "
               "`viwo run --lockstep`"});
  }
  const Params& checked() const {
    live::LiveParams::checked(why_no_name);
    return *this;
  }
  DdsNode::Delivery delivery() const {
    if (lockstep) return DdsNode::Delivery::kEverything;
    return reliable ? DdsNode::Delivery::kReliable : DdsNode::Delivery::kBestEffort;
  }
};

/// Messages that DDS holds for the thread that takes them at once.
constexpr int kMostImages = 100, kMostOthers = 2000, kMostLatched = 100;
constexpr auto kPoll = 100ms, kPollFull = 2ms, kWatchPeriod = 1000ms;

std::unique_ptr<bag::FieldReader> fields_of(std::span<const std::uint8_t> message) {
  return std::make_unique<bag::Ros2Fields>(message);
}

class Ros2Topics final : public live::TopicSensor {
 public:
  Ros2Topics(const Params& params, const HostServices& services)
      : TopicSensor(params.checked(), services, fields_of,
                    params.lockstep ? Pace::kInStep : Pace::kLive),
        delivery_(params.delivery()),
        inlets_(intake().topics().size()),
        node_(params.settings(), [this] { wake(); }) {
    if (params.publish) advertise(params);
    if (mounts().are_asked_for()) ask_for_mounts(params);
    thread_ = std::thread([this] { receive(); });
  }

  ~Ros2Topics() override {
    stop();
    {
      const std::scoped_lock lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }

 private:
  /// What is known of a topic that is wanted.
  struct Inlet {
    dds::DataReader* reader = nullptr;
    std::string type;                           ///< "sensor_msgs/Imu"
    std::map<rtps::GUID_t, std::int64_t> last;  ///< numbers of messages, by publisher
    int publishers = 0;
    bool met = false;  ///< a publisher
    bool finished = false;
    std::set<std::string> refused;  ///< types that were said
  };

  void advertise(const Params& params) {
    odometry_ = &writer(params.odometry_topic_out, "nav_msgs/Odometry", 10);
    if (params.publish_tf) tf_ = &writer("/tf", "tf2_msgs/TFMessage", 100);
    if (!params.path_topic_out.empty()) path_ = &writer(params.path_topic_out, "nav_msgs/Path", 1);
    if (!params.calibration_topic_out.empty()) {
      calibration_ = &writer(params.calibration_topic_out, "sensor_msgs/JointState", 10);
    }
    diagnostics_ = &writer("/diagnostics", "diagnostic_msgs/DiagnosticArray", 10);
  }
  dds::DataWriter& writer(const std::string& topic, const std::string& type, int most) {
    return node_.make_writer(dds_topic(topic), dds_type(type), most);
  }

  void publish(const live::Outgoing& out) override {
    const live::Odometry* const odometry = out.odometry;
    if (odometry != nullptr) write(*odometry_, odometry_message(*odometry));
    if (tf_ != nullptr && odometry != nullptr) write(*tf_, tf_message(*odometry));
    if (path_ != nullptr && out.path != nullptr) {
      write(*path_, path_message(*out.path, odometry->world));
    }
    if (calibration_ != nullptr && out.calibration != nullptr) {
      write(*calibration_, calibration_message(*out.calibration));
    }
    write(*diagnostics_, diagnostics_message(out.diagnostics));
  }

  void ask_for_mounts(const Params& params) {
    const auto latched = [this](const std::string& topic, const std::string& type) {
      return &node_.make_reader(dds_topic(topic), dds_type(type), DdsNode::Delivery::kLatched,
                                kMostLatched);
    };
    tf_static_ = latched("/tf_static", "tf2_msgs/TFMessage");
    if (params.description_topic.empty()) return;
    description_ = latched(params.description_topic, "std_msgs/String");
  }

  void take_frames() {
    bag::Bytes message;
    dds::SampleInfo info;
    while (tf_static_ != nullptr && node_.take(*tf_static_, message, info)) {
      if (info.valid_data) take_transforms(message);
    }
    while (description_ != nullptr && node_.take(*description_, message, info)) {
      if (!info.valid_data) continue;
      try {
        mounts().take_description(std::string(fields_of(message)->text()));
      } catch (const bag::BrokenMessage& broken) {
        services().log(
            LogLevel::kWarning,
            std::string("the robot's description is a message that is broken: ") + broken.what());
      }
    }
  }

  void wake() {
    {
      const std::scoped_lock lock(mutex_);
      woken_ = true;
    }
    changed_.notify_all();
  }

  /// Its own thread: all that has to do with readers.
  void receive() {
    auto watched = Clock::now();
    bool is_full = false;
    while (true) {
      {
        std::unique_lock lock(mutex_);
        changed_.wait_for(lock, is_full ? kPollFull : kPoll,
                          [this] { return stopping_ || woken_; });
        if (stopping_) return;
        woken_ = false;
      }
      try {
        take_frames();
        make_readers();
        is_full = !take_all();
      } catch (const std::exception& error) {
        fail(error.what());
        return;
      }
      if (Clock::now() - watched > kWatchPeriod) {
        watched = Clock::now();
        watch();
        watch_steps();
      }
    }
  }

  /// A reader has a type, which is that of the first publisher whose type is taken.
  void make_readers() {
    const int generation = node_.generation();
    if (std::exchange(generation_, generation) == generation) return;
    for (const DdsNode::Published& there : node_.published()) {
      for (std::size_t i = 0; i < inlets_.size(); ++i) {
        if (there.topic == dds_topic(intake().topics()[i].name)) meet(i, there);
      }
    }
  }

  void meet(std::size_t i, const DdsNode::Published& there) {
    Inlet& inlet = inlets_[i];
    const live::Topic& topic = intake().topics()[i];
    const std::string type = ros_type(there.type);
    if (inlet.reader != nullptr && inlet.type == type) return;
    const auto kind = bag::kind_of(type);
    const bool is_wanted =
        kind && std::find(topic.kinds.begin(), topic.kinds.end(), *kind) != topic.kinds.end() &&
        there.type == dds_type(type) && inlet.reader == nullptr;
    if (!is_wanted) {
      const std::string must = inlet.reader != nullptr
                                   ? inlet.type + " has come before"
                                   : std::string(bag::type_name(topic.kinds.front())) + " must be";
      if (inlet.refused.insert(type).second) {
        intake().reject(i, "a publisher of " + type + " where a " + must, 0);
      }
      return;
    }
    if (delivery_ != DdsNode::Delivery::kBestEffort && !there.reliable) {
      services().log(LogLevel::kWarning,
                     "topic '" + topic.name +
                         "' has a publisher that is best effort: it is not heard while `reliable` "
                         "or `lockstep` asks for more");
    }
    inlet.type = type;
    inlet.reader = &node_.make_reader(there.topic, there.type, delivery_,
                                      topic.camera < 0 ? kMostOthers : kMostImages);
  }

  /// Takes what there is room for; whether that was all.
  bool take_all() {
    bool is_all = true;
    for (std::size_t i = 0; i < inlets_.size(); ++i) {
      Inlet& inlet = inlets_[i];
      if (inlet.reader == nullptr) continue;
      const int before = count_publishers(i);
      bool is_empty = false;
      while (!is_empty && has_room(i)) is_empty = !take_one(i);
      is_all = is_all && is_empty;
      if (steps() != nullptr && is_empty && before == 0 && inlet.met &&
          !std::exchange(inlet.finished, true)) {
        intake().finish(i);
        steps()->finish(i);
      }
    }
    return is_all;
  }

  bool has_room(std::size_t i) {
    return steps() == nullptr || steps()->has_room(i, intake().is_full(i));
  }

  /// How many there are now; said when they are too many, none, or back.
  int count_publishers(std::size_t i) {
    Inlet& inlet = inlets_[i];
    dds::SubscriptionMatchedStatus status;
    inlet.reader->get_subscription_matched_status(status);
    const int now = status.current_count, before = std::exchange(inlet.publishers, now);
    inlet.met = inlet.met || status.total_count > 0;
    if (now == before) return now;
    const std::string topic = "topic '" + intake().topics()[i].name + "'";
    if (now > 1) {
      services().log(LogLevel::kWarning,
                     topic + " has " + std::to_string(now) +
                         " publishers: their messages are taken as those of one");
    } else if (now == 0) {
      services().log(LogLevel::kInfo, topic + " has no publisher any more");
    } else if (before == 0 && !inlet.last.empty()) {
      services().log(LogLevel::kInfo, topic + " has a publisher again");
    }
    return now;
  }

  bool take_one(std::size_t i) {
    Inlet& inlet = inlets_[i];
    auto message = std::make_shared<bag::Bytes>();
    dds::SampleInfo info;
    if (!node_.take(*inlet.reader, *message, info)) return false;
    if (!info.valid_data) return true;
    count_lost(i, info);
    if (inlet.finished) {
      intake().reject(i, "message of a publisher that came when the topic had ended", 0);
      return true;
    }
    intake().take(i, inlet.type, "*", message);
    return true;
  }

  /// By the numbers that publishers give their messages.
  void count_lost(std::size_t i, const dds::SampleInfo& info) {
    const auto number =
        static_cast<std::int64_t>(info.sample_identity.sequence_number().to64long());
    const auto [last, is_first] =
        inlets_[i].last.try_emplace(info.sample_identity.writer_guid(), number);
    const std::int64_t lost = is_first ? 0 : number - last->second - 1;
    last->second = number;
    if (lost <= 0) return;
    intake().reject(i, "message lost on the way", 0, lost);
    if (steps() != nullptr) {
      fail("in step nothing may be lost, and topic '" + intake().topics()[i].name + "' has lost " +
           std::to_string(lost) +
           " messages: let the publisher keep all until they are taken, or play more slowly");
    }
  }

  void watch_steps() {
    if (steps() == nullptr) return;
    if (const std::string why = steps()->deadlock(); !why.empty()) {
      fail("in step a topic waits for the others, and " + why + ", which does not come");
    }
  }

  void name_missing_topics() const override {
    std::set<std::string> there;
    for (const DdsNode::Published& published : node_.published()) {
      if (const auto topic = ros_topic(published.topic)) there.insert(*topic);
    }
    for (std::size_t i = 0; i < inlets_.size(); ++i) {
      if (inlets_[i].reader != nullptr || !inlets_[i].refused.empty()) continue;
      name_missing(intake().topics()[i].name, {there.begin(), there.end()});
    }
  }

  DdsNode::Delivery delivery_;
  std::vector<Inlet> inlets_;  ///< of intake().topics(); only the thread has them
  std::mutex mutex_;
  std::condition_variable changed_;
  int generation_ = 0;  ///< of what is published, as it was looked at last
  bool woken_ = false;
  bool stopping_ = false;
  DdsNode node_;  ///< behind what its threads use
  dds::DataReader* tf_static_ = nullptr;
  dds::DataReader* description_ = nullptr;
  dds::DataWriter* odometry_ = nullptr;
  dds::DataWriter* tf_ = nullptr;
  dds::DataWriter* path_ = nullptr;
  dds::DataWriter* calibration_ = nullptr;
  dds::DataWriter* diagnostics_ = nullptr;
  std::thread thread_;
};

VIWO_REGISTER(Sensor, Ros2Topics, "ros2_topics", "1.0.0",
              "IMU, images, wheels and poses of a running ROS 2 system, by DDS; publishes the "
              "estimate",
              "Apache-2.0", Params);

}  // namespace
}  // namespace viwo::ros2
