// A live sensor that is played: read in a thread of its own, which waits for the run as the run
// waits for it. Nothing is dropped.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "viwo/feed/feed.hpp"
#include "viwo/feed/run_data.hpp"

namespace viwo {

class PlayedSensor {
 public:
  /// Connects those of `streams` that work on its images. Everything outlives it.
  PlayedSensor(const RunSetup& setup, const SensorStream& played,
               const std::vector<SensorStream>& streams, const FeedHooks& hooks);
  ~PlayedSensor() { stop(); }
  PlayedSensor(const PlayedSensor&) = delete;
  PlayedSensor& operator=(const PlayedSensor&) = delete;

  const SensorStream& stream() const { return played_; }
  /// Its next measurement that is not only for those who work on images; it stays until pop().
  /// Waits for it. nullptr at the end, and when the run is interrupted. Throws what the sensor
  /// threw.
  Measurement* head();
  void pop() { has_head_ = false; }
  /// Ends the thread, and those who wait for images. Throws nothing.
  void stop();
  const std::string& not_stopped() const { return not_stopped_; }  ///< why; "" if it was

 private:
  /// Its images, for who works on them.
  class Images final : public Sensor {
   public:
    explicit Images(PlayedSensor& from) : from_(from) {}
    SampleTypes yields() const override { return sample_types<ImageSample>(); }
    Status next(Measurement& out) override;

   private:
    friend PlayedSensor;
    PlayedSensor& from_;
    std::deque<ImageSample> waiting_;
  };

  void read();
  void take(Measurement measurement);
  bool has_room() const;
  bool is_wanted(const SampleType& type) const;
  /// Waits, asking now and then whether the run is interrupted; false when it is.
  template <class Condition>
  bool wait(std::unique_lock<std::mutex>& lock, Condition&& condition);

  const RunSetup& setup_;
  const SensorStream& played_;
  const FeedHooks& hooks_;
  std::vector<std::unique_ptr<Images>> images_;
  Measurement head_;
  bool has_head_ = false;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Measurement> ahead_;
  bool ended_ = false;  ///< nothing more is read
  bool stop_ = false;
  std::exception_ptr error_;
  std::string not_stopped_;
  std::thread thread_;
};

}  // namespace viwo
