#include "viwo/experiment/simulate.hpp"

#include <algorithm>

#include "viwo/log/asl.hpp"

namespace viwo::experiment {

SimulateResult write_log(RunSetup& setup, const std::filesystem::path& folder) {
  // Read first: a sensor whose input is wrong must leave nothing behind.
  std::vector<Measurement> measurements;
  for (auto& entry : setup.sensors) {
    const Loaded<Sensor>& sensor = entry.second;
    guarded(sensor.info, "next", [&] {
      Measurement measurement;
      while (sensor.object->next(measurement) == Status::kOk) measurements.push_back(measurement);
    });
  }
  if (measurements.empty()) throw InputError("no sensor of this run gave a measurement");
  std::stable_sort(measurements.begin(), measurements.end(),
                   [](const auto& a, const auto& b) { return stamp_ns(a) < stamp_ns(b); });
  SimulateResult result;
  log::AslWriter writer(folder);
  for (const Measurement& measurement : measurements) {
    writer.write(measurement);
    ++(std::holds_alternative<EncoderSample>(measurement) ? result.encoder_samples
                                                          : result.reference_poses);
  }
  writer.close();
  return result;
}

}  // namespace viwo::experiment
