#include "viwo/setup/routes.hpp"

#include <algorithm>
#include <optional>

#include "viwo/api/measurement.hpp"
#include "viwo/api/status.hpp"
#include "viwo/config/suggest.hpp"

namespace viwo {
namespace {

bool yields(const SensorYield& sensor, const SampleType& type) {
  return std::any_of(sensor.types.begin(), sensor.types.end(),
                     [&](const SampleType* own) { return own->has_name_of(type); });
}

/// Finds sensors for those who want samples, and says what is wrong.
class Resolver {
 public:
  Resolver(std::span<const SensorYield> sensors, const config::Mark& mark, config::Errors& errors)
      : sensors_(sensors), mark_(mark), errors_(errors) {}

  void error(const std::string& text) { errors_.add(mark_, text); }

  /// All sensors that yield a kind, but for those that `except` names.
  std::vector<const SensorYield*> of(const SampleType& type,
                                     std::span<const std::string> except = {}) const {
    std::vector<const SensorYield*> found;
    for (const SensorYield& sensor : sensors_) {
      const bool left_out = std::find(except.begin(), except.end(), sensor.name) != except.end();
      if (!left_out && yields(sensor, type)) found.push_back(&sensor);
    }
    return found;
  }

  /// The only one of `found`; an error when there are more.
  std::string only(const std::vector<const SensorYield*>& found, const SampleType& type,
                   const std::string& remedy) {
    if (found.empty()) return "";
    if (found.size() > 1) {
      error("both '" + found[0]->name + "' and '" + found[1]->name + "' give " + type.name +
            ": a run takes them from one sensor" + remedy);
    }
    return found.front()->name;
  }

  /// The sensor `name`, or the only one; "" and an error where there is none. `remedy`: what to do
  /// where there are several.
  std::string find(const std::string& name, const SampleType& type, const std::string& taker,
                   bool optional, const std::string& remedy = " - name it: sensor: NAME") {
    if (name.empty()) {
      const auto all = of(type);
      if (all.empty() && !optional) {
        error(std::string("no sensor of this run gives ") + type.name + ", which " + taker +
              " needs");
      }
      return only(all, type, remedy);
    }
    const auto sensor = std::find_if(sensors_.begin(), sensors_.end(),
                                     [&](const SensorYield& s) { return s.name == name; });
    if (sensor == sensors_.end()) {
      std::vector<std::string> names;
      for (const SensorYield& other : sensors_) names.push_back(other.name);
      error(taker + ": no sensor '" + name + "'" + config::did_you_mean(name, names));
      return "";
    }
    if (yields(*sensor, type)) return name;
    if (!optional) {
      error("sensor '" + name + "' gives no " + type.name + ", which " + taker + " needs");
    }
    return "";
  }

 private:
  std::span<const SensorYield> sensors_;
  config::Mark mark_;
  config::Errors& errors_;
};

}  // namespace

Routes Routes::resolve(std::span<const SensorYield> sensors, const Wanted& wanted,
                       const config::Mark& mark, config::Errors& errors) {
  Routes routes;
  routes.sensors_.assign(sensors.begin(), sensors.end());
  Resolver resolver(sensors, mark, errors);
  const auto add = [&](const std::string& sensor, const SampleType& type, Consumer consumer,
                       std::size_t stream = 0) {
    if (!sensor.empty()) routes.routes_.push_back({sensor, &type, consumer, stream});
  };
  if (wanted.filter) {
    const auto& imu = sample_type<ImuSample>();
    add(resolver.find("", imu, "the filter", false, ""), imu, Consumer::kImu);
  } else if (const auto all = resolver.of(sample_type<ImuSample>()); all.size() == 1) {
    add(all.front()->name, sample_type<ImuSample>(), Consumer::kImu);
  }
  const auto& headings = sample_type<HeadingSample>();
  add(resolver.only(resolver.of(headings), headings, ""), headings, Consumer::kHeading);
  const auto& poses = sample_type<PoseSample>();
  for (std::size_t i = 0; i < wanted.streams.size(); ++i) {
    const SharedStream& stream = wanted.streams[i];
    if (*stream.spec.type == poses && stream.spec.sensor.empty()) {
      // The only one that gives poses may be the reference, which then would be gone.
      resolver.error(stream.takers + " needs the sensor that gives its poses (sensor: NAME)");
      continue;
    }
    add(resolver.find(stream.spec.sensor, *stream.spec.type, stream.takers, stream.spec.optional),
        *stream.spec.type, Consumer::kStream, i);
  }
  const auto& encoders = sample_type<EncoderSample>();
  if (wanted.wheels) {
    // For the filter these are what its updates take, and known without an error of its own.
    config::Errors told;
    Resolver quiet(sensors, mark, wanted.filter ? told : errors);
    add(quiet.find(wanted.wheels_sensor, encoders, "the kinematic model", wanted.filter,
                   " - name it: wheels.sensor: NAME"),
        encoders, Consumer::kWheels);
  }
  const auto& states = sample_type<StateSample>();
  const std::string states_sensor = resolver.only(resolver.of(states), states, "");
  add(states_sensor, states, Consumer::kReferenceStates);
  // Of a sensor that also knows the states, poses are measurements; and so are those that an update
  // measures with, also one that is turned off.
  const auto referring = resolver.of(poses, wanted.measuring);
  for (const SensorYield* sensor : referring) {
    if (states_sensor.empty() || sensor->name == states_sensor) continue;
    resolver.error("both '" + states_sensor + "' and '" + sensor->name +
                   "' give a reference: a run takes it from one sensor");
  }
  if (states_sensor.empty()) {
    add(resolver.only(referring, poses, " as reference"), poses, Consumer::kReferencePoses);
  }
  const auto& truth = sample_type<CalibrationSample>();
  for (const SensorYield* sensor : resolver.of(truth)) {
    add(sensor->name, truth, Consumer::kTrueCalibration);
  }
  const auto& images = sample_type<ImageSample>();
  add(resolver.only(resolver.of(images), images, ""), images, Consumer::kPictures);
  return routes;
}

std::string Routes::sensor_of(Consumer consumer) const {
  for (const Route& route : routes_) {
    if (route.consumer == consumer) return route.sensor;
  }
  return "";
}

void Routes::require_yielded(const std::string& sensor, const SampleType& type) const {
  for (const SensorYield& known : sensors_) {
    if (known.name == sensor && yields(known, type)) return;
  }
  throw InputError("sensor '" + sensor + "' gives " + type.name +
                   ", which it does not say it yields");
}

}  // namespace viwo
