#include "viwo/run/simulate.hpp"

#include <algorithm>
#include <vector>

#include "viwo/asl/asl.hpp"
#include "viwo/feed/inputs.hpp"

namespace viwo {

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
  const bool has_states =
      std::any_of(measurements.begin(), measurements.end(),
                  [](const Measurement& m) { return m.get_if<StateSample>() != nullptr; });
  for (const Measurement& measurement : measurements) {
    const auto* pose = measurement.get_if<PoseSample>();
    bool is_written = true;
    if (has_states && pose != nullptr) {
      writer.write_measured(*pose);
    } else {
      is_written = writer.write(measurement);
    }
    ++(is_written ? result.counts : result.left_out)[measurement.view().type().name];
  }
  writer.close();
  return result;
}

std::string describe(const SimulateResult& result) {
  struct Kind {
    const SampleType& type;
    const char* one;
    const char* many;
  };
  const auto count_of = [](const auto& counts, const SampleType& type) {
    const auto found = counts.find(type.name);
    return found != counts.end() ? found->second : 0;
  };
  // Poses beside true states are measured.
  const bool measured = count_of(result.counts, sample_type<StateSample>()) > 0;
  const Kind kinds[] = {{sample_type<ImuSample>(), "IMU sample", "IMU samples"},
                        {sample_type<FeatureSample>(), "tracked image", "tracked images"},
                        {sample_type<ImageSample>(), "image", "images"},
                        {sample_type<EncoderSample>(), "encoder sample", "encoder samples"},
                        {sample_type<PoseSample>(), measured ? "measured pose" : "reference pose",
                         measured ? "measured poses" : "reference poses"},
                        {sample_type<GnssSample>(), "GNSS fix", "GNSS fixes"},
                        {sample_type<StateSample>(), "reference state", "reference states"},
                        {sample_type<CalibrationSample>(), "true parameter", "true parameters"}};
  std::vector<std::string> parts;
  for (const Kind& kind : kinds) {
    const std::int64_t n = count_of(result.counts, kind.type);
    if (n > 0) parts.push_back(std::to_string(n) + " " + (n == 1 ? kind.one : kind.many));
  }
  std::string text;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (i > 0) text += i + 1 < parts.size() ? ", " : " and ";
    text += parts[i];
  }
  for (const auto& [kind, n] : result.left_out) {
    text += "; not written, as there is no table for them: " + std::to_string(n) + " " + kind;
  }
  return text;
}

}  // namespace viwo
