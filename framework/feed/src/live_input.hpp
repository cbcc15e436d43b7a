// From the thread of a live sensor to that of another one that works on its images.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "viwo/api/sensor.hpp"

namespace viwo {

inline double milliseconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

/// What a live sensor gives, as the input of another one: next() waits for it.
class LiveInput final : public Sensor {
 public:
  SampleTypes yields() const override { return sample_types<ImageSample>(); }
  void push(const ImageSample& image) {
    {
      const std::scoped_lock lock(mutex_);
      if (images_.size() == kMaxWaitingImages) {
        // All images of the oldest instant: one of a stereo pair alone is of little use.
        const std::int64_t oldest_ns = images_.front().t_ns;
        while (!images_.empty() && images_.front().t_ns <= oldest_ns + kSameInstantNs) {
          if (dropped_++ == 0) first_dropped_ns_ = oldest_ns;
          images_.pop_front();
        }
      }
      images_.push_back(image);
    }
    changed_.notify_all();
  }
  void end() {
    {
      const std::scoped_lock lock(mutex_);
      ended_ = true;
    }
    changed_.notify_all();
  }
  Status next(Measurement& out) override {
    const auto begin = std::chrono::steady_clock::now();
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return ended_ || !images_.empty(); });
    waited_ms_ += milliseconds_since(begin);
    if (images_.empty()) return Status::kEnd;
    out = std::move(images_.front());
    images_.pop_front();
    return Status::kOk;
  }
  /// How long the reader has waited so far. In its thread.
  double waited_ms() const { return waited_ms_; }
  void rejections(std::vector<RejectionCount>& out) const override {
    const std::scoped_lock lock(mutex_);
    if (dropped_ == 0) return;
    out.push_back({"image dropped: it came faster than images can be worked on", dropped_,
                   stamp_text(first_dropped_ns_)});
  }

 private:
  /// Images that may wait; more than these are old news.
  static constexpr std::size_t kMaxWaitingImages = 8;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<ImageSample> images_;
  bool ended_ = false;
  double waited_ms_ = 0.;
  std::int64_t dropped_ = 0;
  std::int64_t first_dropped_ns_ = 0;
};

}  // namespace viwo
