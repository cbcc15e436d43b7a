// What comes while a robot runs: messages in any order.
#include "target.hpp"
#if defined(VIWO_FUZZ_ROS1) || defined(VIWO_FUZZ_ROS2)
#include <algorithm>
#include <chrono>
#include <limits>
#include <memory>

#include "intake.hpp"
#include "live_queue.hpp"
#include "step_queue.hpp"
#endif
#ifdef VIWO_FUZZ_ROS1
#include "ros1_fields.hpp"
#endif
#ifdef VIWO_FUZZ_ROS2
#include "ros2_fields.hpp"
#endif

namespace viwo::fuzz {
#if defined(VIWO_FUZZ_ROS1) || defined(VIWO_FUZZ_ROS2)
namespace {

/// Takes bytes off the front; what is not there is zero.
class Input {
 public:
  explicit Input(Bytes bytes) : left_(bytes) {}
  bool is_empty() const { return left_.empty(); }
  std::uint8_t byte() {
    const Bytes one = bytes(1);
    return one.empty() ? std::uint8_t{0} : one[0];
  }
  Bytes bytes(std::size_t n) {
    const Bytes taken = left_.first(std::min(n, left_.size()));
    left_ = left_.subspan(taken.size());
    return taken;
  }

 private:
  Bytes left_;
};

template <class Fields>
std::unique_ptr<bag::FieldReader> fields_of(Bytes message) {
  return std::make_unique<Fields>(message);
}

/// All that waits. What a sensor of a running system gives must be usable; played in step, it is in
/// time order.
void drain(live::MeasurementQueue& queue, bool in_step, std::int64_t& last_ns) {
  using Taken = live::MeasurementQueue::Taken;
  Measurement out;
  while (queue.pop(out, std::chrono::milliseconds(0)) == Taken::kMeasurement) {
    const SampleView view = out.view();
    require(view.type().fault(view.data()) == nullptr, "a sample that cannot be used");
    if (in_step) require(view.t_ns() >= last_ns, "a stamp before the last");
    last_ns = view.t_ns();
    const auto* image = out.get_if<ImageSample>();
    if (image == nullptr) continue;
    try {
      Image pixels;
      image->source->read(pixels);
    } catch (const InputError&) {
    }
  }
}

/// The first byte says how it is played; then messages: topic, what it is said to be, size (two
/// bytes), bytes.
void live_messages(Bytes bytes, live::MakeFields make_fields) {
  Input in(bytes);
  const std::uint8_t how = in.byte();
  const bool in_step = (how & 1U) != 0;
  bag::TopicOptions options;
  options.imu_topic = "/imu";
  options.joint_topic = "/joints";
  options.drive_joints = {"a"};
  options.steer_joints = {"b"};
  options.drive_input =
      (how & 2U) != 0 ? bag::TopicOptions::Drive::kPosition : bag::TopicOptions::Drive::kVelocity;
  options.pose_topic = "/pose";
  options.odometry_topic = "/odometry";
  options.gnss_topic = "/fix";
  options.image_topics = {"/left", "/right"};
  constexpr std::size_t kMostImages = 4, kMostOthers = 30;
  const std::vector<live::Topic> topics = live::wanted_topics(options);
  const HostServices services;
  std::unique_ptr<live::MeasurementQueue> queue;
  live::StepQueue* step = nullptr;
  if (in_step) {
    auto own = std::make_unique<live::StepQueue>(topics, kMostImages);
    step = own.get();
    queue = std::move(own);
  } else {
    queue = std::make_unique<live::LiveQueue>(kMostImages, kMostOthers);
  }
  live::Intake intake(options, services, *queue, make_fields,
                      in_step ? live::Pace::kInStep : live::Pace::kLive);
  std::int64_t last_ns = std::numeric_limits<std::int64_t>::min();
  while (!in.is_empty()) {
    const std::uint8_t which = in.byte();
    const std::size_t topic = which % topics.size();
    const std::uint8_t said = in.byte();
    const std::size_t low = in.byte();
    const Bytes message = in.bytes(low + 256U * in.byte());
    if ((which & 0x80U) != 0) drain(*queue, in_step, last_ns);
    if (step != nullptr && !step->has_room(topic)) continue;
    const auto& kinds = topics[topic].kinds;
    const std::string type(bag::type_name(kinds[said % kinds.size()]));
    intake.take(topic, type, "*", std::make_shared<bag::Bytes>(message.begin(), message.end()));
  }
  for (std::size_t topic = 0; topic < topics.size(); ++topic) {
    intake.finish(topic);
    if (step != nullptr) step->finish(topic);
  }
  queue->end();
  drain(*queue, in_step, last_ns);
  require(intake.silent_topics(std::chrono::hours(1)).empty(), "a topic silent for an hour");
  std::vector<RejectionCount> counts;
  intake.rejections(counts);
  queue->rejections(counts);
  if (last_ns == std::numeric_limits<std::int64_t>::min()) throw InputError("no measurement");
}

}  // namespace

std::vector<Target> live_targets() {
  constexpr const char* kSources =
      "plugins/shared/live/intake.cpp plugins/shared/live/live_cells.cpp "
      "plugins/shared/live/live_queue.cpp plugins/shared/live/step_queue.cpp";
  return {
#ifdef VIWO_FUZZ_ROS1
      {"live_ros1", [](Bytes bytes) { live_messages(bytes, fields_of<bag::Ros1Fields>); },
       kSources},
#endif
#ifdef VIWO_FUZZ_ROS2
      {"live", [](Bytes bytes) { live_messages(bytes, fields_of<bag::Ros2Fields>); }, kSources},
#endif
  };
}
#else
std::vector<Target> live_targets() { return {}; }
#endif

}  // namespace viwo::fuzz
