#include "viwo/experiment/simulate.hpp"

#include <algorithm>
#include <vector>

#include "inputs.hpp"
#include "viwo/log/asl.hpp"

namespace viwo::experiment {

SimulateResult write_log(RunSetup& setup, const std::filesystem::path& folder) {
  // Read first: a sensor whose input is wrong must leave nothing behind.
  std::vector<Measurement> measurements;
  Inputs inputs(setup.sensors);
  for (const SensorEntry& entry : setup.sensors) {
    require_no_live_sensor(setup, entry);
    const auto input = inputs.connect(entry);  // outlives the reading
    guarded(entry.sensor.info, "next", [&] {
      Measurement measurement;
      while (entry.sensor.object->next(measurement) == Status::kOk) {
        measurements.push_back(measurement);
        inputs.keep(entry, measurement);
      }
    });
  }
  if (measurements.empty()) throw InputError("no sensor of this run gave a measurement");
  std::stable_sort(measurements.begin(), measurements.end(),
                   [](const auto& a, const auto& b) { return stamp_ns(a) < stamp_ns(b); });
  SimulateResult result;
  log::AslWriter writer(folder);
  // Beside true states, poses are measurements, and have a table of their own.
  const bool has_states = std::any_of(measurements.begin(), measurements.end(), [](const auto& m) {
    return std::holds_alternative<StateSample>(m);
  });
  for (const Measurement& measurement : measurements) {
    const auto* pose = std::get_if<PoseSample>(&measurement);
    if (has_states && pose != nullptr) {
      writer.write_measured(*pose);
    } else {
      writer.write(measurement);
    }
    ++result.counts[measurement.index()];
  }
  writer.close();
  return result;
}

std::string describe(const SimulateResult& result) {
  struct Kind {
    std::size_t index;
    const char* one;
    const char* many;
  };
  // `index` is that of the kind in Measurement.
  static_assert(std::variant_size_v<Measurement> == 7);
  const bool measured = result.counts[4] > 0;  // poses beside true states
  const Kind kinds[] = {{2, "IMU sample", "IMU samples"},
                        {3, "tracked image", "tracked images"},
                        {6, "image", "images"},
                        {0, "encoder sample", "encoder samples"},
                        {1, measured ? "measured pose" : "reference pose",
                         measured ? "measured poses" : "reference poses"},
                        {4, "reference state", "reference states"},
                        {5, "true parameter", "true parameters"}};
  std::vector<std::string> parts;
  for (const Kind& kind : kinds) {
    const std::int64_t n = result.counts[kind.index];
    if (n > 0) parts.push_back(std::to_string(n) + " " + (n == 1 ? kind.one : kind.many));
  }
  std::string text;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (i > 0) text += i + 1 < parts.size() ? ", " : " and ";
    text += parts[i];
  }
  return text;
}

}  // namespace viwo::experiment
