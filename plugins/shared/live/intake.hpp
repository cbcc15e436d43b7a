// From messages as they come to measurements in the queue; what cannot be used is counted, and said
// once.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bag.hpp"
#include "joint_reading.hpp"
#include "live_cells.hpp"
#include "live_queue.hpp"
#include "messages.hpp"
#include "topic_options.hpp"
#include "viwo/api/host_services.hpp"
#include "viwo/api/rejections.hpp"
#include "viwo/api/stamp_order.hpp"
#include "viwo/math/set_back_clock.hpp"

namespace viwo::live {

/// The fields of a message, as the ROS at hand serialises them; BrokenMessage when it is none.
using MakeFields = std::unique_ptr<bag::FieldReader> (*)(std::span<const std::uint8_t> message);

/// Whether measurements are given as they come, with what can be told by then, or in step: those
/// that the same messages in a bag give.
enum class Pace : std::uint8_t { kLive, kInStep };

/// A topic that is wanted.
struct Topic {
  std::string name;
  std::vector<bag::Kind> kinds;  ///< what may be on it
  int camera = -1;               ///< index of its images
};

/// Images outlive the intake, and end in any thread.
using HeldBytes = std::atomic<std::size_t>;

std::vector<Topic> wanted_topics(const bag::TopicOptions& options);

class Intake {
 public:
  using Clock = std::chrono::steady_clock;

  /// `services` and `queue` outlive it.
  Intake(const bag::TopicOptions& options, const HostServices& services, MeasurementQueue& queue,
         MakeFields make_fields, Pace pace = Pace::kLive);

  const std::vector<Topic>& topics() const { return topics_; }

  /// A message on topics()[topic] of type `type` ("sensor_msgs/Imu"), with the md5 sum of its
  /// definition ("*": not known). From any thread.
  void take(std::size_t topic, const std::string& type, const std::string& md5,
            const std::shared_ptr<const bag::Bytes>& message);
  /// No more comes on a topic: what waited for its next message is given.
  void finish(std::size_t topic);
  /// Counts what was wrong with `n` messages of a topic before they got here.
  void reject(std::size_t topic, const std::string& reason, std::int64_t t_ns, std::int64_t n = 1);

  /// Whether no more images of a topic should come, for what those that there are take of memory.
  /// Not in step they are left out then.
  bool is_full(std::size_t topic) const;

  /// When something came last that could be used; of all topics.
  std::optional<Clock::time_point> last_use() const;
  /// The newest stamp of all topics.
  std::optional<std::int64_t> newest_ns() const;
  /// Topics of which nothing could be used for longer than this, of fixes five times as long.
  std::vector<std::string> silent_topics(std::chrono::milliseconds longer_than) const;
  void rejections(std::vector<RejectionCount>& out) const;

 private:
  struct State {
    std::optional<std::int64_t> last_ns;
    StampJump jump;
    SetBackClock clock{10};
    Clock::time_point last_use = Clock::now();
  };

  void read(std::size_t topic, bag::Kind kind, const std::shared_ptr<const bag::Bytes>& message);
  void take_imu(std::size_t topic, const ImuSample& imu);
  void take_pose(std::size_t topic, PoseSample pose);
  void take_fix(std::size_t topic, const std::optional<GnssSample>& fix);
  void take_joints(std::size_t topic, const bag::Joints& joints);
  void take_image(std::size_t topic, std::int64_t t_ns,
                  const std::shared_ptr<const bag::Bytes>& message, bool is_compressed);
  bool is_slow(std::size_t topic) const;
  StampJump jump_of(const Topic& topic) const;
  void begin_again(std::size_t topic);
  bool accept(std::size_t topic, std::int64_t t_ns);
  void drop(std::size_t topic, const std::string& reason, std::int64_t t_ns, std::int64_t n = 1);
  void count(std::size_t topic, const std::string& reason, std::int64_t t_ns,
             const char* consequence, std::int64_t n = 1);

  bag::TopicOptions options_;
  const HostServices& services_;
  MeasurementQueue& queue_;
  MakeFields make_fields_;
  Pace pace_;
  std::vector<Topic> topics_;

  mutable std::mutex mutex_;
  std::vector<State> states_;
  bag::JointReadings parts_;
  log::JointMap joints_;
  LiveCells cells_;
  LogCells log_cells_;  ///< instead, in step
  ImageOrder image_order_;
  std::vector<ImageSample> ready_;
  std::shared_ptr<HeldBytes> held_ = std::make_shared<HeldBytes>(0);
  std::optional<Clock::time_point> last_use_;
  Rejections counts_;
};

}  // namespace viwo::live
