// Sensors made from configuration text, as the host makes them.
#pragma once

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "viwo/config/yaml.hpp"
#include "viwo/plugin_host/registry.hpp"

namespace viwo {

inline PluginRegistry& registry() {
  static PluginRegistry the_registry({VIWO_TEST_PLUGIN_DIR});
  return the_registry;
}

/// Throws InputError with what the host would print.
inline std::shared_ptr<Sensor> make_sensor(const std::string& yaml, std::uint64_t seed = 1) {
  config::Errors errors;
  const auto loaded =
      registry().make_sensor(config::parse(yaml, "test.yaml"), "sensor", seed, errors);
  errors.throw_if_any();
  return loaded.object;
}

inline std::string error_of(const std::string& yaml) {
  try {
    make_sensor(yaml);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

/// Everything a sensor yields; it must be in time order.
inline std::vector<Measurement> play(Sensor& sensor) {
  std::vector<Measurement> out;
  Measurement measurement;
  while (sensor.next(measurement) == Status::kOk) {
    if (!out.empty()) {
      EXPECT_LE(stamp_ns(out.back()), stamp_ns(measurement));
    }
    out.push_back(measurement);
  }
  EXPECT_EQ(sensor.next(measurement), Status::kEnd);
  return out;
}

template <class Sample>
std::vector<Sample> only(const std::vector<Measurement>& measurements) {
  std::vector<Sample> out;
  for (const Measurement& measurement : measurements) {
    if (const auto* sample = std::get_if<Sample>(&measurement)) out.push_back(*sample);
  }
  return out;
}

template <class Sample>
std::vector<Sample> play_only(const std::string& yaml, std::uint64_t seed = 1) {
  return only<Sample>(play(*make_sensor(yaml, seed)));
}

}  // namespace viwo
