// Sensors of a run that give what is in memory, in the place of those of its configuration.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "viwo/run/run.hpp"

namespace viwo::testing {

/// Gives measurements of the kinds that it says.
class InMemory : public Sensor {
 public:
  InMemory(SampleTypes types, std::vector<Measurement> measurements)
      : types_(std::move(types)), measurements_(std::move(measurements)) {}
  SampleTypes yields() const override { return types_; }
  Status next(Measurement& out) override {
    if (next_ == measurements_.size()) return Status::kEnd;
    out = measurements_[next_++];
    return Status::kOk;
  }

 private:
  SampleTypes types_;
  std::vector<Measurement> measurements_;
  std::size_t next_ = 0;
};

/// Who would get what in a run if these were its sensors. Throws InputError.
inline Routes routes_for(const RunSetup& setup, const std::vector<SensorYield>& sensors) {
  Wanted wanted;
  wanted.wheels = setup.model != nullptr;
  if (setup.filter) {
    wanted.filter = true;
    wanted.streams = setup.filter->streams;
    wanted.measuring = setup.filter->measuring;
    if (wanted.wheels) wanted.wheels_sensor = setup.filter->wheels.front().prior.sensor;
  }
  config::Errors errors;
  auto routes = Routes::resolve(sensors, wanted, setup.sensors_mark, errors);
  errors.throw_if_any();
  return routes;
}

/// Gives a run other sensors. Throws InputError when those do not fit.
inline void set_sensors(
    RunSetup& setup, const std::vector<std::pair<std::string, std::shared_ptr<Sensor>>>& sensors) {
  setup.sensors.clear();
  std::vector<SensorYield> yields;
  for (const auto& [name, sensor] : sensors) {
    setup.sensors.push_back({name, {}, ""});
    setup.sensors.back().sensor.object = sensor;
    yields.push_back({name, sensor->yields()});
  }
  setup.routes = routes_for(setup, yields);
}

/// All samples of a kind as measurements, behind the others in `all`.
template <Sample T>
void append(const Recorded& recorded, std::vector<Measurement>& all) {
  for (const T& sample : recorded.of<T>()) all.emplace_back(sample);
}

/// What a filter takes of a recorded run, in the order of stamps: IMU, encoders, tracks.
inline std::vector<Measurement> in_time_order(const Recorded& recorded) {
  std::vector<Measurement> all;
  append<ImuSample>(recorded, all);
  append<EncoderSample>(recorded, all);
  append<FeatureSample>(recorded, all);
  std::stable_sort(all.begin(), all.end(), [](const Measurement& a, const Measurement& b) {
    return stamp_ns(a) < stamp_ns(b);
  });
  return all;
}

}  // namespace viwo::testing
