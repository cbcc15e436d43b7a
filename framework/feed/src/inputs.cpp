#include "viwo/feed/inputs.hpp"

#include "stream.hpp"

namespace viwo {

Inputs::Inputs(const std::vector<SensorEntry>& sensors) {
  for (const SensorEntry& entry : sensors) {
    if (entry.input.empty() || kept_.contains(entry.input)) continue;
    kept_.emplace(entry.input, std::make_shared<std::vector<Measurement>>());
  }
}

void Inputs::keep(const SensorEntry& entry, const Measurement& measurement) {
  const auto found = kept_.find(entry.name);
  if (found != kept_.end()) found->second->push_back(measurement);
}

std::shared_ptr<Sensor> Inputs::replay(const std::string& input) const {
  return std::make_shared<Replay>(kept_.at(input));
}

std::shared_ptr<Sensor> Inputs::connect(const SensorEntry& entry) {
  if (entry.input.empty()) return nullptr;
  auto input = replay(entry.input);
  guarded(entry.sensor.info, "connect", [&] { entry.sensor.object->connect(*input); });
  return input;
}

bool is_live(const SensorEntry& entry) {
  return guarded(entry.sensor.info, "live", [&] { return entry.sensor.object->live(); });
}

void require_no_live_sensor(const RunSetup& setup, const SensorEntry& entry) {
  if (!is_live(entry)) return;
  config::fail(setup.sensors_mark, "sensor '" + entry.name +
                                       "' is live, without an end: `viwo run` "
                                       "alone can use it, with the filter");
}

}  // namespace viwo
