#include "step_queue.hpp"

#include <algorithm>
#include <utility>

namespace viwo::live {
namespace {

int rank_of(bag::Kind kind) {
  switch (kind) {
    case bag::Kind::kPose:
    case bag::Kind::kPoseWithCovariance:
    case bag::Kind::kOdometry:
      return 0;
    case bag::Kind::kImu:
      return 1;
    case bag::Kind::kJoints:
      return 2;
    case bag::Kind::kNavSatFix:
      return 3;
    default:
      return 4;  // images, which stand in the order of their cameras
  }
}

}  // namespace

StepQueue::StepQueue(const std::vector<Topic>& topics, std::size_t max_images) {
  for (const Topic& topic : topics) {
    waiting_.push_back({topic.name,
                        rank_of(topic.kinds.front()),
                        topic.camera < 0 ? kMaxOthers : max_images,
                        {},
                        false});
  }
}

void StepQueue::push(Measurement measurement, std::size_t topic) {
  {
    const std::scoped_lock lock(mutex_);
    if (ended_) return;
    waiting_[topic].measurements.push_back(std::move(measurement));
  }
  changed_.notify_one();
}

/// A topic that everything waits for.
const StepQueue::Waiting* StepQueue::awaited() const {
  const auto found = std::find_if(waiting_.begin(), waiting_.end(), [this](const Waiting& one) {
    return one.measurements.empty() && !one.finished && !ended_;
  });
  return found == waiting_.end() ? nullptr : &*found;
}

StepQueue::Waiting* StepQueue::first() {
  if (awaited() != nullptr) return nullptr;
  Waiting* best = nullptr;
  const auto key = [](const Waiting& one) {
    return std::pair(stamp_ns(one.measurements.front()), one.rank);
  };
  for (Waiting& one : waiting_) {
    if (one.measurements.empty()) continue;
    if (best == nullptr || key(one) < key(*best)) best = &one;
  }
  return best;
}

StepQueue::Taken StepQueue::pop(Measurement& out, std::chrono::milliseconds wait) {
  std::unique_lock lock(mutex_);
  Waiting* from = nullptr;
  const auto all_finished = [this] {
    return ended_ || std::all_of(waiting_.begin(), waiting_.end(),
                                 [](const Waiting& one) { return one.finished; });
  };
  changed_.wait_for(lock, wait, [&] {
    from = first();
    return from != nullptr || all_finished();
  });
  if (from == nullptr) return all_finished() ? Taken::kEnded : Taken::kNothing;
  out = std::move(from->measurements.front());
  from->measurements.pop_front();
  return Taken::kMeasurement;
}

void StepQueue::end() {
  {
    const std::scoped_lock lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
}

bool StepQueue::ended() const {
  const std::scoped_lock lock(mutex_);
  return ended_;
}

void StepQueue::finish(std::size_t topic) {
  {
    const std::scoped_lock lock(mutex_);
    waiting_[topic].finished = true;
  }
  changed_.notify_all();
}

std::size_t StepQueue::limit(const Waiting& waiting) const {
  return awaited() != nullptr ? kWhileWaiting * waiting.most : waiting.most;
}

bool StepQueue::has_room(std::size_t topic, bool is_full) const {
  const std::scoped_lock lock(mutex_);
  const Waiting& waiting = waiting_[topic];
  return waiting.measurements.size() < (is_full ? 1 : limit(waiting));
}

std::string StepQueue::deadlock() const {
  const std::scoped_lock lock(mutex_);
  const Waiting* const other = awaited();
  if (other == nullptr) return {};
  for (const Waiting& one : waiting_) {
    if (one.measurements.size() < limit(one)) continue;
    return "topic '" + one.topic + "' waits for '" + other->topic + "'";
  }
  return {};
}

}  // namespace viwo::live
