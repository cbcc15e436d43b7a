// Sensors that give measurements as they happen. Each has a thread, and so has each sensor that
// works on what another one gives; all of them put what they give into one queue, from which the
// estimator takes it in the order of arrival.
//
// Nothing grows without bound when the estimator is slower than what happens: who finds the queue
// full waits. A sensor that works on images then gets too many of them, of which the oldest go, and
// there is less to do; a sensor that still gets too much drops by itself, and counts.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "begin_thread.hpp"
#include "has_next.hpp"
#include "image_arrivals.hpp"
#include "live_input.hpp"
#include "live_samples.hpp"
#include "viwo/feed/estimate_sample.hpp"
#include "viwo/feed/feed.hpp"
#include "viwo/math/stamp.hpp"

namespace viwo {
namespace {

using Clock = std::chrono::steady_clock;

/// Measurements that may wait for the estimator: those of some seconds.
constexpr std::size_t kMaxArrivals = 1000;
/// After an interruption, the time for what waits, and for sensors to end, each.
constexpr std::chrono::milliseconds kRestTime(1000);
constexpr std::chrono::milliseconds kEndTime(3000);
/// Poses of a reference that are kept of a run without end.
constexpr std::size_t kMostReference = 16'384;
constexpr std::chrono::milliseconds kPollPeriod(50);
/// When nothing comes at all, time passes by the clock of this machine.
constexpr std::chrono::milliseconds kIdleTime(1000);

/// What threads of sensors and the estimator share. A sensor that does not end when it is asked to
/// keeps it, and itself, alive.
class LiveFeed final : public std::enable_shared_from_this<LiveFeed> {
 public:
  LiveFeed(const RunSetup& setup, const RunData& data, const FeedHooks& hooks,
           Plausibility& plausibility)
      : setup_(setup),
        hooks_(hooks),
        plausibility_(plausibility),
        live_(data.live),
        samples_(setup, kMostReference) {
    for (const SensorStream& stream : data.streams) {
      workers_.push_back({stream, std::make_unique<LiveInput>(), {}});
      LiveInput& input = *workers_.back().input;
      guarded(stream.info, "connect", [&] { stream.sensor->connect(input); });
    }
  }

  void begin() {
    const auto self = shared_from_this();
    threads_.reserve(live_.size() + workers_.size());
    try {
      for (const SensorStream& stream : live_) {
        add_thread(stream.name, [self, &stream] { self->listen(stream); });
      }
      for (Worker& worker : workers_) {
        add_thread(worker.stream.name, [self, &worker] { self->work(worker); });
      }
    } catch (...) {
      stop();  // those that have begun
      throw;
    }
  }

  bool next(Estimator& estimator) {
    Arrival arrival;
    {
      const auto begin = Clock::now();
      std::unique_lock lock(mutex_);
      while (!changed_.wait_for(lock, kPollPeriod,
                                [this] { return !arrivals_.empty() || running_.empty(); })) {
        lock.unlock();
        if (is_over()) return false;
        if (const auto waited = Clock::now() - begin; waited > kIdleTime) {
          plausibility_.wait(std::chrono::duration<double>(waited).count());
          return true;
        }
        lock.lock();
      }
      if (arrivals_.empty()) {
        if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
        return false;
      }
      arrival = std::move(arrivals_.front());
      arrivals_.pop_front();
    }
    room_.notify_all();
    if (is_over()) return false;
    give(*arrival.sensor, arrival.measurement.view(), estimator);
    return true;
  }

  bool is_over() {
    if (!hooks_.interrupted || !hooks_.interrupted()) return false;
    if (!interrupted_at_) {
      interrupted_at_ = Clock::now();
      stop_sensors();
    }
    return Clock::now() - *interrupted_at_ > kRestTime;
  }

  void on_epoch(const Estimator& estimator, int piece, const std::vector<std::string>& warnings) {
    const Filter& filter = estimator.filter();
    EstimateSample sample = estimate_sample(filter, piece, warnings);
    sample.latency_s = arrivals_of_images_.latency_s(filter.t_ns());
    if (std::isfinite(sample.latency_s)) latency_ms_.add(1e3 * sample.latency_s);
    for (const SensorStream& stream : live_) {
      guarded(stream.info, "estimate", [&] { stream.sensor->estimate(sample); });
    }
  }

  FeedReport finish() {
    FeedReport report;
    const std::vector<std::string> left = stop();
    for (const std::string& name : left) {
      report.warnings.push_back("sensor '" + name + "' did not end when it was asked to");
    }
    try {
      if (stop_error_) std::rethrow_exception(stop_error_);
    } catch (const std::exception& error) {
      report.warnings.push_back(not_stopped_text(error));
    }
    const auto has_ended = [&](const std::string& name) {
      return std::find(left.begin(), left.end(), name) == left.end();
    };
    samples_.finish(report);
    for (const Worker& worker : workers_) {
      if (!has_ended(worker.stream.name)) continue;
      report.stages.emplace_back("sensor " + worker.stream.name, worker.ms_per_stamp.stage());
    }
    if (!latency_ms_.is_empty()) {
      report.stages.emplace_back("latency from image to pose", latency_ms_.stage());
    }
    const auto add = [&](const std::string& name, const Sensor& sensor) {
      std::vector<RejectionCount> all;
      if (has_ended(name)) sensor.rejections(all);
      for (RejectionCount& rejection : all) report.rejections.emplace_back(name, rejection);
    };
    for (const SensorStream& stream : live_) add(stream.name, *stream.sensor);
    for (const Worker& worker : workers_) {
      add(worker.stream.name, *worker.stream.sensor);
      add(worker.stream.input_name, *worker.input);
    }
    return report;
  }

  /// Ends all threads; the names of the sensors whose threads do not.
  std::vector<std::string> stop() {
    if (threads_.empty()) return {};
    stop_sensors();
    end_inputs();
    std::vector<std::string> left;
    {
      std::unique_lock lock(mutex_);
      ended_ = true;
      room_.notify_all();
      changed_.wait_for(lock, kEndTime, [this] { return running_.empty(); });
      left = running_;
    }
    for (std::thread& thread : threads_) left.empty() ? thread.join() : thread.detach();
    threads_.clear();
    return left;
  }

 private:
  struct Arrival {
    const std::string* sensor = nullptr;
    Measurement measurement;
  };

  /// A sensor that works on what a live one gives.
  struct Worker {
    SensorStream stream;
    std::unique_ptr<LiveInput> input;
    TimeStatistics ms_per_stamp;  ///< without the waiting
  };

  template <class Work>
  void add_thread(const std::string& sensor, Work work) {
    {
      const std::scoped_lock lock(mutex_);
      running_.push_back(sensor);
    }
    try {
      threads_.push_back(begin_thread("sensor '" + sensor + "'", [this, &sensor, work] {
        try {
          work();
        } catch (...) {
          end_with(std::current_exception());
        }
        note_end(sensor);
      }));
    } catch (...) {
      note_end(sensor);
      throw;
    }
  }

  /// Nothing may leave a thread. The run ends, also when other sensors could go on.
  void end_with(std::exception_ptr error) {
    {
      const std::scoped_lock lock(mutex_);
      if (!error_) error_ = std::move(error);
    }
    stop_sensors();
    end_inputs();
  }

  void note_end(const std::string& sensor) {
    {
      const std::scoped_lock lock(mutex_);
      running_.erase(std::find(running_.begin(), running_.end(), sensor));
    }
    changed_.notify_all();
  }

  void end_inputs() {
    for (const Worker& worker : workers_) worker.input->end();
  }

  void listen(const SensorStream& stream) {
    read(stream, [&](const Measurement& measurement) {
      const auto* image = measurement.get_if<ImageSample>();
      if (image == nullptr) return true;
      arrivals_of_images_.note(imu_ns(*image));
      for (const Worker& worker : workers_) {
        if (worker.stream.input_name == stream.name) worker.input->push(*image);
      }
      if (hooks_.on_live_image) hooks_.on_live_image(*image);
      return is_taken(stream.name, sample_type<ImageSample>());
    });
    for (const Worker& worker : workers_) {
      if (worker.stream.input_name == stream.name) worker.input->end();
    }
  }

  /// When an image was taken, by the clock of the IMU as far as it is configured.
  std::int64_t imu_ns(const ImageSample& image) const {
    const auto camera = static_cast<std::size_t>(image.camera);
    if (!setup_.filter || camera >= setup_.filter->cameras.size()) return image.t_ns;
    const CameraView& view = setup_.filter->cameras[camera].camera;
    return image.t_ns + to_ns(view.image_offset_s());
  }

  void work(Worker& worker) {
    auto begin = Clock::now();
    double waited_ms = 0., spent_ms = 0.;
    std::optional<std::int64_t> stamp;
    read(worker.stream, [&](const Measurement& measurement) {
      if (stamp && stamp_ns(measurement) != *stamp) {
        worker.ms_per_stamp.add(std::exchange(spent_ms, 0.));
      }
      spent_ms += milliseconds_since(begin) - (worker.input->waited_ms() - waited_ms);
      stamp = stamp_ns(measurement);
      waited_ms = worker.input->waited_ms();
      begin = Clock::now();
      return true;
    });
    if (stamp) worker.ms_per_stamp.add(spent_ms);
  }

  /// Reads a sensor to its end; `wanted` says whether the estimator is to have a measurement.
  template <class Wanted>
  void read(const SensorStream& stream, Wanted&& wanted) {
    Measurement measurement;
    while (has_next(stream.info, *stream.sensor, measurement)) {
      if (is_at_end()) break;
      if (!wanted(measurement)) continue;
      {
        std::unique_lock lock(mutex_);
        room_.wait(lock, [this] { return ended_ || arrivals_.size() < kMaxArrivals; });
        if (ended_) break;
        arrivals_.push_back({&stream.name, std::move(measurement)});
      }
      changed_.notify_all();
    }
  }

  /// Whether an update takes this kind from this sensor.
  bool is_taken(const std::string& sensor, const SampleType& type) const {
    const auto routes = setup_.routes.all();
    return std::any_of(routes.begin(), routes.end(), [&](const Route& route) {
      return route.consumer == Consumer::kStream && route.sensor == sensor && *route.type == type;
    });
  }

  bool is_at_end() {
    const std::scoped_lock lock(mutex_);
    return ended_;
  }

  /// All of them, whatever one of them does; finish() says what.
  void stop_sensors() {
    for (const SensorStream& stream : live_) {
      try {
        guarded(stream.info, "stop", [&] { stream.sensor->stop(); });
      } catch (...) {
        const std::scoped_lock lock(mutex_);
        stop_error_ = std::current_exception();
      }
    }
  }

  void give(const std::string& sensor, SampleView sample, Estimator& estimator) {
    samples_.note(sensor, sample);
    plausibility_.add(sensor, sample);
    setup_.routes.dispatch(sensor, sample.type(), [&](const Route& route) {
      if (route.consumer == Consumer::kImu) estimator.add(*sample.get_if<ImuSample>());
      if (route.consumer == Consumer::kStream) estimator.add(route.stream, sample);
    });
  }

  const RunSetup& setup_;  // setup and hooks: not after stop()
  const FeedHooks& hooks_;
  Plausibility& plausibility_;  // neither
  const std::vector<SensorStream> live_;
  std::vector<Worker> workers_;
  LiveSamples samples_;
  ImageArrivals arrivals_of_images_;
  TimeStatistics latency_ms_;
  std::optional<Clock::time_point> interrupted_at_;

  std::mutex mutex_;
  std::condition_variable changed_;  ///< something has arrived, or a thread has ended
  std::condition_variable room_;     ///< something was taken
  bool ended_ = false;
  std::deque<Arrival> arrivals_;
  std::vector<std::string> running_;  ///< sensors whose threads have not ended
  std::exception_ptr error_, stop_error_;
  std::vector<std::thread> threads_;
};

/// Ends it, whatever its threads do.
class LiveFeedOwner final : public Feed {
 public:
  explicit LiveFeedOwner(std::shared_ptr<LiveFeed> feed) : feed_(std::move(feed)) {
    feed_->begin();
  }
  ~LiveFeedOwner() override { feed_->stop(); }
  bool next(Estimator& estimator) override { return feed_->next(estimator); }
  bool is_over() override { return feed_->is_over(); }
  void on_epoch(const Estimator& estimator, int piece,
                const std::vector<std::string>& warnings) override {
    feed_->on_epoch(estimator, piece, warnings);
  }
  FeedReport finish() override { return feed_->finish(); }

 private:
  std::shared_ptr<LiveFeed> feed_;
};

}  // namespace

std::unique_ptr<Feed> feed_live(const RunSetup& setup, const RunData& data, const FeedHooks& hooks,
                                Plausibility& plausibility) {
  return std::make_unique<LiveFeedOwner>(
      std::make_shared<LiveFeed>(setup, data, hooks, plausibility));
}

}  // namespace viwo
