// Sensors that give measurements as they happen. Each has a thread, and so has each sensor that
// works on what another one gives; all of them put what they give into one queue, from which the
// estimator takes it in the order of arrival.
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "channels.hpp"
#include "feed.hpp"
#include "viwo/math/arrays.hpp"

namespace viwo::experiment {
namespace {

using Clock = std::chrono::steady_clock;

/// Images that may wait for a sensor that works on them; more than these are old news.
constexpr std::size_t kMaxWaitingImages = 8;
constexpr std::chrono::milliseconds kPollPeriod(50);
/// Clocks of cameras are nearer to that of the IMU than this.
constexpr std::int64_t kMaxClockOffsetNs = 50'000'000;

double milliseconds_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
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
    const auto begin = Clock::now();
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
                   "stamp " + std::to_string(first_dropped_ns_) + " ns"});
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<ImageSample> images_;
  bool ended_ = false;
  double waited_ms_ = 0.;
  std::int64_t dropped_ = 0;
  std::int64_t first_dropped_ns_ = 0;
};

class LiveFeed final : public Feed {
 public:
  LiveFeed(const RunSetup& setup, const RunData& data, const RunHooks& hooks)
      : setup_(setup), data_(data), hooks_(hooks) {
    for (const SensorStream& stream : data.streams) {
      workers_.push_back({&stream, std::make_unique<LiveInput>(), {}});
      LiveInput& input = *workers_.back().input;
      guarded(stream.info, "connect", [&] { stream.sensor->connect(input); });
    }
    running_ = data.live.size() + workers_.size();
    for (const SensorStream& stream : data.live) {
      threads_.emplace_back([this, &stream] { listen(stream); });
    }
    for (Worker& worker : workers_) threads_.emplace_back([this, &worker] { work(worker); });
  }
  ~LiveFeed() override { stop(); }

  bool next(Estimator& estimator) override {
    Arrival arrival;
    {
      std::unique_lock lock(mutex_);
      while (!changed_.wait_for(lock, kPollPeriod,
                                [this] { return !arrivals_.empty() || running_ == 0; })) {
        if (!interrupted()) continue;
        lock.unlock();
        stop_sensors();
        lock.lock();
      }
      if (arrivals_.empty()) {
        if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
        return false;
      }
      arrival = std::move(arrivals_.front());
      arrivals_.pop_front();
    }
    if (interrupted()) stop_sensors();
    give(*arrival.sensor, arrival.measurement.view(), estimator);
    return true;
  }

  void on_epoch(const Estimator& estimator) override {
    const Filter& filter = estimator.filter();
    EstimateSample sample = sample_of(filter);
    sample.calibration_names = calibration_names(filter);
    for (const BlockEstimate& estimate : calibration_of(filter)) {
      sample.calibration.push_back(estimate.value);
      sample.calibration_sigma.push_back(estimate.sigma);
    }
    sample.latency_s = latency_s(filter.t_ns());
    if (sample.latency_s > 0.) latency_ms_.push_back(1e3 * sample.latency_s);
    for (const SensorStream& stream : data_.live) {
      guarded(stream.info, "estimate", [&] { stream.sensor->estimate(sample); });
    }
  }

  void finish(RunResult& result) override {
    stop();
    result.reference = std::move(reference_);
    if (!has_imu_ && result.cause.empty()) {
      result.cause = "nothing has come: no IMU sample arrived";
    }
    for (const Worker& worker : workers_) {
      result.stages.emplace_back("sensor " + worker.stream->name, stage_time(worker.ms_per_stamp));
    }
    result.stages.emplace_back("latency from image to pose", stage_time(latency_ms_));
    const auto add = [&](const std::string& name, const Sensor& sensor) {
      std::vector<RejectionCount> all;
      sensor.rejections(all);
      for (RejectionCount& rejection : all) result.rejections.emplace_back(name, rejection);
    };
    for (const SensorStream& stream : data_.live) add(stream.name, *stream.sensor);
    for (const Worker& worker : workers_) {
      add(worker.stream->name, *worker.stream->sensor);
      add(worker.stream->input_name, *worker.input);
    }
  }

 private:
  struct Arrival {
    const std::string* sensor = nullptr;
    Measurement measurement;
  };

  /// A sensor that works on what a live one gives.
  struct Worker {
    const SensorStream* stream = nullptr;
    std::unique_ptr<LiveInput> input;
    std::vector<double> ms_per_stamp;  ///< without the waiting
  };

  void listen(const SensorStream& stream) {
    run_thread(stream, [&](const Measurement& measurement) {
      const auto* image = measurement.get_if<ImageSample>();
      if (image == nullptr) return true;
      {
        const std::scoped_lock lock(mutex_);
        seen_.emplace_back(image->t_ns, Clock::now());
        if (seen_.size() > 64) seen_.pop_front();
      }
      for (const Worker& worker : workers_) {
        if (worker.stream->input_name == stream.name) worker.input->push(*image);
      }
      if (hooks_.on_live_image) hooks_.on_live_image(*image);
      return is_taken(stream.name, sample_type<ImageSample>());
    });
    for (const Worker& worker : workers_) {
      if (worker.stream->input_name == stream.name) worker.input->end();
    }
  }

  void work(Worker& worker) {
    auto begin = Clock::now();
    double waited_ms = 0.;
    std::int64_t stamp = 0;
    run_thread(*worker.stream, [&](const Measurement& measurement) {
      std::vector<double>& spent = worker.ms_per_stamp;
      if (spent.empty() || stamp_ns(measurement) != stamp) spent.push_back(0.);
      spent.back() += milliseconds_since(begin) - (worker.input->waited_ms() - waited_ms);
      stamp = stamp_ns(measurement);
      waited_ms = worker.input->waited_ms();
      begin = Clock::now();
      return true;
    });
  }

  /// Reads a sensor to its end; `wanted` says whether the estimator is to have a measurement.
  template <class Wanted>
  void run_thread(const SensorStream& stream, Wanted&& wanted) {
    try {
      Measurement measurement;
      while (guarded(stream.info, "next", [&] { return stream.sensor->next(measurement); }) ==
             Status::kOk) {
        if (!wanted(measurement)) continue;
        {
          const std::scoped_lock lock(mutex_);
          arrivals_.push_back({&stream.name, std::move(measurement)});
        }
        changed_.notify_all();
      }
    } catch (...) {
      {
        const std::scoped_lock lock(mutex_);
        if (!error_) error_ = std::current_exception();
      }
      stop_sensors();  // the run ends, also when the others could go on
    }
    {
      const std::scoped_lock lock(mutex_);
      --running_;
    }
    changed_.notify_all();
  }

  /// Whether an update takes this kind from this sensor.
  bool is_taken(const std::string& sensor, const SampleType& type) const {
    const auto routes = setup_.routes.all();
    return std::any_of(routes.begin(), routes.end(), [&](const Route& route) {
      return route.consumer == Consumer::kStream && route.sensor == sensor && *route.type == type;
    });
  }

  bool interrupted() const { return hooks_.interrupted && hooks_.interrupted(); }

  void stop_sensors() {
    for (const SensorStream& stream : data_.live) {
      guarded(stream.info, "stop", [&] { stream.sensor->stop(); });
    }
  }

  void stop() {
    if (threads_.empty()) return;
    stop_sensors();
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
  }

  void give(const std::string& sensor, SampleView sample, Estimator& estimator) {
    const auto* wheels = sample.get_if<EncoderSample>();
    if (wheels != nullptr && checked_.insert(sensor).second) {
      require_channels(setup_, sensor, *wheels);
    }
    setup_.routes.dispatch(sensor, sample.type(), [&](const Route& route) {
      switch (route.consumer) {
        case Consumer::kImu:
          has_imu_ = true;
          estimator.add(*sample.get_if<ImuSample>());
          break;
        case Consumer::kStream:
          estimator.add(route.stream, sample);
          break;
        case Consumer::kReferencePoses:
          add_reference(*sample.get_if<PoseSample>());
          break;
        default:
          break;
      }
    });
  }

  void add_reference(const PoseSample& pose) {
    reference_.push_back(
        {pose.t_ns, to_vector(pose.p_BinW_m), to_quaternion(pose.q_BtoW_xyzw).normalized()});
  }

  static EstimateSample sample_of(const Filter& filter) {
    const ImuView& imu = filter.imu();
    EstimateSample sample;
    sample.t_ns = filter.t_ns();
    const Eigen::Quaterniond q_ItoG(imu.R_GtoI.transpose());
    sample.q_ItoG_xyzw = {q_ItoG.x(), q_ItoG.y(), q_ItoG.z(), q_ItoG.w()};
    Eigen::Vector3d::Map(sample.p_IinG_m.data()) = imu.p_IinG;
    Eigen::Vector3d::Map(sample.v_IinG_m_per_s.data()) = imu.v_IinG;
    if (!filter.clones().empty()) {
      Eigen::Vector3d::Map(sample.w_IinI_rad_per_s.data()) = filter.clones().back().w_IinI;
    }
    Eigen::Map<Eigen::Matrix<double, 9, 9, Eigen::RowMajor>>(sample.covariance.data()) =
        filter.covariance().topLeftCorner<9, 9>();
    return sample;
  }

  /// Since the arrival of the newest image of an epoch; 0 without one.
  double latency_s(std::int64_t t_ns) {
    const std::scoped_lock lock(mutex_);
    double latency = 0.;
    std::int64_t nearest = kMaxClockOffsetNs;
    for (const auto& [stamp, arrived] : seen_) {
      const std::int64_t off = std::abs(stamp - t_ns);
      if (off > nearest) continue;
      nearest = off;
      latency = std::chrono::duration<double>(Clock::now() - arrived).count();
    }
    return latency;
  }

  const RunSetup& setup_;
  const RunData& data_;
  const RunHooks& hooks_;
  std::vector<Worker> workers_;
  bool has_imu_ = false;
  std::set<std::string> checked_;  ///< sensors whose encoder channels have been looked at
  Trajectory reference_;
  std::vector<double> latency_ms_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Arrival> arrivals_;
  std::deque<std::pair<std::int64_t, Clock::time_point>> seen_;  ///< images: stamp and arrival
  std::size_t running_ = 0;
  std::exception_ptr error_;
  std::vector<std::thread> threads_;
};

}  // namespace

std::unique_ptr<Feed> feed_live(const RunSetup& setup, const RunData& data, const RunHooks& hooks) {
  return std::make_unique<LiveFeed>(setup, data, hooks);
}

}  // namespace viwo::experiment
