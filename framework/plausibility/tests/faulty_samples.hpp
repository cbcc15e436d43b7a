// The samples of a simulated robot, half a minute of them, with one thing done to all or some of
// them, and what is found in them.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "registry.hpp"
#include "sensors_in_memory.hpp"
#include "viwo/plausibility/plausibility.hpp"
#include "viwo/run/run.hpp"
#include "viwo/setup/configuration.hpp"

namespace viwo::testing {

/// What is done to the samples of each sensor.
struct Fault {
  std::function<void(ImuSample&)> imu = [](ImuSample&) {};
  std::function<void(EncoderSample&)> wheels = [](EncoderSample&) {};
  std::function<void(FeatureSample&)> images = [](FeatureSample&) {};
};

inline RunSetup robot(const std::string& name, const std::vector<std::string>& more = {},
                      std::uint64_t seed = 1) {
  std::vector<std::string> assignments = {"sensors.simulator0.duration_s=30",
                                          "estimator.calibration_error_scale=0"};
  assignments.insert(assignments.end(), more.begin(), more.end());
  const config::Node run = resolve_placeholders(
      load_run_configuration(configuration("runs/" + name + ".yaml"), assignments));
  return read_run(run, registry(), seed);
}

/// The texts of what is found in samples with a fault.
inline std::vector<std::string> found(RunSetup setup, const Fault& fault) {
  static std::map<std::string, std::vector<Measurement>> known;
  std::vector<Measurement>& samples = known[setup.name];
  if (samples.empty()) samples = in_time_order(collect(setup).recorded);
  const auto sensor = [](const SampleType& type) {
    return std::make_shared<InMemory>(SampleTypes{&type}, std::vector<Measurement>{});
  };
  set_sensors(setup, {{"imu0", sensor(sample_type<ImuSample>())},
                      {"wheels0", sensor(sample_type<EncoderSample>())},
                      {"images0", sensor(sample_type<FeatureSample>())}});
  Plausibility plausibility(setup);
  for (const Measurement& sample : samples) {
    if (const auto* imu = sample.get_if<ImuSample>()) {
      ImuSample changed = *imu;
      fault.imu(changed);
      plausibility.add("imu0", changed);
    } else if (const auto* wheels = sample.get_if<EncoderSample>()) {
      EncoderSample changed = *wheels;
      fault.wheels(changed);
      plausibility.add("wheels0", changed);
    } else if (const auto* images = sample.get_if<FeatureSample>()) {
      FeatureSample changed = *images;
      fault.images(changed);
      plausibility.add("images0", changed);
    }
  }
  plausibility.finish();
  std::vector<std::string> texts;
  for (const Finding& finding : plausibility.findings()) texts.push_back(finding.text);
  return texts;
}

inline std::vector<std::string> found(const Fault& fault) {
  return found(robot("viwo_swerve"), fault);
}

inline void scale(std::array<double, 3>& values, double factor) {
  for (double& value : values) value *= factor;
}

inline void scale_drives(EncoderSample& wheels, double factor) {
  for (double& rate : wheels.drive_rad_per_s) rate *= factor;
}

}  // namespace viwo::testing
