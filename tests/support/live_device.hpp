// A live sensor that gives what it was made with, and runs on it.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "sensors_in_memory.hpp"
#include "simulated.hpp"
#include "viwo/run/run.hpp"

namespace viwo::testing {

/// Gives what it was made with, then waits for stop(), or ends at once. What it yields is what the
/// routes of a test say.
class Device : public Sensor {
 public:
  Device(std::vector<Measurement> measurements, bool waits)
      : measurements_(std::move(measurements)), waits_(waits) {}
  SampleTypes yields() const override { return {}; }
  bool live() const override { return true; }
  Status next(Measurement& out) override {
    if (next_ < measurements_.size()) {
      out = measurements_[next_++];
      return Status::kOk;
    }
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return stopped_ || !waits_; });
    return Status::kEnd;
  }
  void stop() override {
    {
      const std::scoped_lock lock(mutex_);
      stopped_ = true;
    }
    changed_.notify_all();
  }
  void estimate(const EstimateSample& estimate) override { estimates.push_back(estimate); }
  std::vector<EstimateSample> estimates;

 private:
  std::vector<Measurement> measurements_;
  std::size_t next_ = 0;
  bool waits_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopped_ = false;
};

/// Breaks after all that it was made with has been given.
class BreakingDevice : public Device {
 public:
  explicit BreakingDevice(std::vector<Measurement> measurements,
                          std::string error = "the cable is out")
      : Device(std::move(measurements), false), error_(std::move(error)) {}
  Status next(Measurement& out) override {
    const Status status = Device::next(out);
    if (status == Status::kEnd) throw InputError(error_);
    return status;
  }

 private:
  std::string error_;
};

/// A robot with wheels, IMU and a camera that starts while it moves.
inline RunSetup standing_then_driving(double duration_s = 4.,
                                      const std::string& estimator = "start: moving") {
  const std::string robot = std::string("{type: four_wis_wid, ") + kSwerve + "}";
  const std::string cameras = VIWO_TEST_SOURCE_DIR "/configs/cameras/pinhole.yaml";
  const config::Node run = config::parse(
      "sensors: {sim: {type: simulator, motion: sweep_then_straight, duration_s: " +
          std::to_string(duration_s) + ", features: 40, cameras: " + cameras + ", robot: " + robot +
          "}}\nkinematics: " + robot + "\ncameras: {kalibr: " + cameras + "}\nestimator: {" +
          estimator + "}\nupdates: {visual_features: {}, wheel_odometry: {}}\n",
      "run.yaml");
  return read_run(run, registry(), 1);
}

/// Who gets what of a sensor 'device' that gives all that a filter takes, and of others.
inline Routes routes_of_device(const RunSetup& setup, std::vector<SensorYield> others = {}) {
  others.push_back({"device", sample_types<ImuSample, EncoderSample, FeatureSample>()});
  return routes_for(setup, others);
}

inline SensorStream stream(const std::string& name, std::shared_ptr<Sensor> sensor,
                           const std::string& input = "") {
  SensorStream out;
  out.name = name;
  out.sensor = std::move(sensor);
  out.input_name = input;
  return out;
}

}  // namespace viwo::testing
