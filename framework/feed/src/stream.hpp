// Sensors that are read while the filter runs: in a thread of their own, a few measurements ahead.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "viwo/api/sensor.hpp"
#include "viwo/feed/run_data.hpp"

namespace viwo {

/// Plays measurements that are in memory: the input of a sensor that takes one.
class Replay final : public Sensor {
 public:
  explicit Replay(std::shared_ptr<const std::vector<Measurement>> measurements)
      : measurements_(std::move(measurements)) {}
  SampleTypes yields() const override { return {}; }  // who reads it knows what to look for
  Status next(Measurement& out) override {
    if (next_ == measurements_->size()) return Status::kEnd;
    out = (*measurements_)[next_++];
    return Status::kOk;
  }

 private:
  std::shared_ptr<const std::vector<Measurement>> measurements_;
  std::size_t next_ = 0;
};

/// Reads a sensor ahead in a thread. What comes out, and in which order, is what the sensor gives:
/// the thread changes when it is computed, not what.
class Prefetch {
 public:
  explicit Prefetch(const SensorStream& stream);
  ~Prefetch() { stop(); }
  Prefetch(const Prefetch&) = delete;
  Prefetch& operator=(const Prefetch&) = delete;

  /// The next measurement, which stays until pop(); nullptr at the end. Waits for it. Throws what
  /// the sensor threw.
  const Measurement* head();
  void pop();

  const std::string& name() const { return name_; }
  /// Ends the thread; what it has read ahead is lost.
  void stop();
  /// After stop(): how long the sensor took for each stamp, ms of time on the clock.
  const std::vector<double>& ms_per_stamp() const { return ms_per_stamp_; }
  /// After stop(): what the sensor has dropped.
  std::vector<RejectionCount> rejections() const;

 private:
  void read();
  /// One call of next(), timed.
  Status read_one(Measurement& out);

  std::string name_;
  PluginInfo info_;
  std::shared_ptr<Sensor> sensor_;
  std::vector<double> ms_per_stamp_;
  std::int64_t stamp_ns_ = 0;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Measurement> ahead_;
  bool ended_ = false;
  bool stop_ = false;
  std::exception_ptr error_;
  Measurement head_;
  bool has_head_ = false;
  std::thread thread_;
};

}  // namespace viwo
