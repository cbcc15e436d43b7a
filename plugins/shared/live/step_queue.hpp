// The queue of a sensor that is played in step: measurements in the order in which a bag of the
// same messages gives them, whatever the order and the pace of their arrival.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "intake.hpp"
#include "live_queue.hpp"

namespace viwo::live {

/// A measurement is given when every topic has one that is not earlier, or is finished; nothing is
/// dropped. So who receives must stop when there is no room(), which lets a reliable publisher
/// wait.
class StepQueue final : public MeasurementQueue {
 public:
  /// Measurements of a topic that may wait, of images `max_images`. Where one topic waits for
  /// another, this many times more.
  static constexpr std::size_t kMaxOthers = 1000, kWhileWaiting = 20;

  StepQueue(const std::vector<Topic>& topics, std::size_t max_images);

  void push(Measurement measurement, std::size_t topic) override;
  Taken pop(Measurement& out, std::chrono::milliseconds wait) override;
  /// As if all topics were finished.
  void end() override;
  bool ended() const override;
  void rejections(std::vector<RejectionCount>& /*out*/) const override {}

  /// Nothing more comes on a topic.
  void finish(std::size_t topic);
  /// Whether another message of the topic should be received now; `is_full`: only if none waits,
  /// as others may wait for it.
  bool has_room(std::size_t topic, bool is_full = false) const;
  /// "topic '/a' waits for '/b'" when there is no room although nothing can be given.
  std::string deadlock() const;

 private:
  struct Waiting {
    std::string topic;
    int rank;  ///< of measurements of one stamp: as BagSensor gives them
    std::size_t most;
    std::deque<Measurement> measurements;
    bool finished = false;
  };

  std::size_t limit(const Waiting& waiting) const;
  const Waiting* awaited() const;
  Waiting* first();

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Waiting> waiting_;
  bool ended_ = false;
};

}  // namespace viwo::live
