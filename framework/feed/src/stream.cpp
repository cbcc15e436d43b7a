#include "stream.hpp"

#include <chrono>

#include "begin_thread.hpp"
#include "has_next.hpp"

namespace viwo {
namespace {

/// Measurements that a thread may be ahead; a few images of all cameras.
constexpr std::size_t kAhead = 16;

}  // namespace

Prefetch::Prefetch(const SensorStream& stream)
    : name_(stream.name),
      info_(stream.info),
      sensor_(stream.sensor),
      thread_(begin_thread("sensor '" + stream.name + "'", [this] { read(); })) {}

void Prefetch::stop() {
  if (!thread_.joinable()) return;
  {
    const std::scoped_lock lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::vector<RejectionCount> Prefetch::rejections() const {
  std::vector<RejectionCount> all;
  guarded(info_, "rejections", [&] { sensor_->rejections(all); });
  return all;
}

Status Prefetch::read_one(Measurement& out) {
  const auto begin = std::chrono::steady_clock::now();
  const Status status = guarded(info_, "next", [&] { return sensor_->next(out); });
  const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - begin;
  require_answer(info_, status);
  if (status != Status::kOk) return status;
  // The images of one instant are one piece of work, whichever of them the sensor does it for.
  if (ms_per_stamp_.empty() || stamp_ns(out) != stamp_ns_) ms_per_stamp_.push_back(0.);
  ms_per_stamp_.back() += spent.count();
  stamp_ns_ = stamp_ns(out);
  return status;
}

void Prefetch::read() {
  for (;;) {
    bool more = false;
    std::exception_ptr error;
    try {
      Measurement measurement;
      more = read_one(measurement) == Status::kOk;
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return stop_ || ahead_.size() < kAhead; });
      more = more && !stop_;
      if (more) ahead_.push_back(std::move(measurement));
    } catch (...) {
      more = false;
      error = std::current_exception();
    }
    const std::scoped_lock lock(mutex_);
    ended_ = !more;
    error_ = error;
    changed_.notify_all();
    if (ended_) return;
  }
}

const Measurement* Prefetch::head() {
  if (has_head_) return &head_;
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return ended_ || !ahead_.empty(); });
  if (ahead_.empty()) {
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
    return nullptr;
  }
  head_ = std::move(ahead_.front());
  ahead_.pop_front();
  has_head_ = true;
  changed_.notify_all();
  return &head_;
}

void Prefetch::pop() { has_head_ = false; }

}  // namespace viwo
