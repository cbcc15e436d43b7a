// Sensors made from configuration text, as the host makes them.
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "in_folder.hpp"
#include "message_of.hpp"
#include "registry.hpp"
#include "rejections.hpp"
#include "viwo/config/yaml.hpp"

namespace viwo {

using testing::registry;
using testing::rejections_of;

class SensorsInFolder : public testing::InFolder {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    return InFolder::write(name, text).string();
  }
};

/// Throws InputError with what the host would print. `exact`: HostServices::exact.
inline std::shared_ptr<Sensor> make_sensor(const std::string& yaml, std::uint64_t seed = 1,
                                           bool exact = false) {
  config::Errors errors;
  const auto loaded =
      registry().make_sensor(config::parse(yaml, "test.yaml"), "sensor", seed, errors, {}, exact);
  errors.throw_if_any();
  return loaded.object;
}

inline std::string error_of(const std::string& yaml) {
  return testing::error_of([&] { make_sensor(yaml); });
}

/// The names of the kinds of samples that a sensor says it yields.
inline std::set<std::string> kinds_of(const Sensor& sensor) {
  std::set<std::string> out;
  for (const SampleType* type : sensor.yields()) EXPECT_TRUE(out.insert(type->name).second);
  return out;
}

/// Everything a sensor yields; it must be of the kinds that the sensor names, and in time order but
/// where a clock is set back.
inline std::vector<Measurement> play(Sensor& sensor, bool is_set_back = false) {
  const auto kinds = kinds_of(sensor);
  std::vector<Measurement> out;
  Measurement measurement;
  while (sensor.next(measurement) == Status::kOk) {
    EXPECT_TRUE(kinds.contains(measurement.view().type().name));
    if (!out.empty() && !is_set_back) {
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
    if (const auto* sample = measurement.get_if<Sample>()) out.push_back(*sample);
  }
  return out;
}

template <class Sample>
std::vector<Sample> play_only(const std::string& yaml, std::uint64_t seed = 1) {
  return only<Sample>(play(*make_sensor(yaml, seed)));
}

}  // namespace viwo
